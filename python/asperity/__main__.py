"""``python -m asperity`` is the command."""

import sys

from asperity._command import main

if __name__ == "__main__":
    sys.exit(main())
