"""Run the command line with `python -m depthtrack`."""

import sys

from depthtrack.cli import main

sys.exit(main())
