"""`python -m zwidth`: the command, of the very Python that runs it."""

from zwidth.show.cli.main import main

if __name__ == "__main__":
    main()
