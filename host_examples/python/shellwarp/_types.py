"""Types that the package's signatures name."""

from collections.abc import Callable
from typing import Any, Literal, Optional, Union

from numpy.typing import NDArray

Array = NDArray[Any]
Buffer = Union[bytes, bytearray, memoryview]
Steps = Union[int, Literal["auto"]]   # Newton steps of the full shell, or as many as a state at rest needs
Watch = Optional[Callable[[float], Optional[bool]]]   # hears what a search leaves of the force; False stops it
Report = dict[str, Any]   # a report of the interface, by the names of its fields
