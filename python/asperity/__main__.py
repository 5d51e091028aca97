"""Entry point of ``python -m asperity``."""

import sys

from asperity._command import main

if __name__ == "__main__":
    sys.exit(main())
