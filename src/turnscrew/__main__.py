"""`python -m turnscrew`: the command line."""

from turnscrew.cli import main

raise SystemExit(main())
