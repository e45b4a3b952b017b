"""What a wall is guaranteed against: every passive operator, every spring, every passive environment.

    passive        stable with whatever passive linear operator holds the handle
    spring-stable  stable with whatever spring holds the handle
    stable         stable with the handle as the device is described: the stability chart

Each is a set of walls (K, B) inside the next; `find_guarantees` puts them side by side. `two_port` and `coupling`
ask the same of a virtual coupling between the device and an environment that is passive and otherwise unknown.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
