"""The compiled half of truefield."""

__version__: str
