"""python -m fem_seal: the command line where the script is not on the path."""

import sys

from fem_seal.cli import main

if __name__ == "__main__":
    sys.exit(main())
