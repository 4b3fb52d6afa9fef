"""`python -m facewright`: the `facewright` program."""

import sys

from facewright import run

if __name__ == "__main__":
    sys.exit(run(sys.argv[1:]))
