"""``python -m asperity`` is the command."""

import sys

from asperity._command import main

sys.exit(main())
