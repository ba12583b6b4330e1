"""``python -m armangle`` is the command ``armangle``."""

import sys

from .cli import main

sys.exit(main())
