"""`python -m truefield` is the command `truefield`."""

import sys

from truefield.cli import main

if __name__ == "__main__":
    sys.exit(main())
