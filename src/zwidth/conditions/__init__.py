"""Published conditions on virtual walls, one file per source, and their comparison on one loop."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
