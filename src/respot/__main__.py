"""``python -m respot``."""

from respot.cli import main

if __name__ == "__main__":
    main()
