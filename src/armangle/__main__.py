"""``python -m armangle`` runs the command ``armangle``."""

import sys

from .cli import main

sys.exit(main())
