"""`vidtrack` and `python -m vidtrack`."""

from vidtrack.cli import main

if __name__ == "__main__":
    main()
