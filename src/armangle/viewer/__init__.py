"""The viewer in the browser: drag the tool, turn the elbow, see what blocks, play a motion.

Needs viser: ``pip install 'armangle[view]'``. `ViewerState` is the part without a browser.
"""

from .server import LOOPBACK, Viewer
from .state import Answer, ElbowCircle, ViewerState

__all__ = ["LOOPBACK", "Answer", "ElbowCircle", "Viewer", "ViewerState"]
