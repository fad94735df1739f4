"""The documentation site: what `make docs` puts into the pages of `docs/` from the code and from other pages."""
