"""What happens on contact: the loop in time, with all that is not linear about it."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
