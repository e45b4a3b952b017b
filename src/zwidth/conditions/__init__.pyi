from .bound import Bound as Bound
from .registry import compare as compare
