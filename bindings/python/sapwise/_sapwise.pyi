from os import PathLike
from types import TracebackType
from typing import Any, Callable, Literal, Sequence, final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import disjoint_base

__all__ = [
    "BroadPhase",
    "Decision",
    "Space",
    "Tuning",
    "View",
    "__version__",
    "last_decision",
    "measure_hardware",
    "pairs",
    "pairs_between",
    "predict",
    "restored_space",
]

__version__: str

_Pair = tuple[ArrayLike | None, ArrayLike | None]

def pairs(
    boxes: ArrayLike,
    upper: ArrayLike | None = None,
    *,
    groups: ArrayLike | None = None,
    masks: ArrayLike | None = None,
    owner: ArrayLike | None = None,
    fixed: ArrayLike | None = None,
    margin: float = 0.0,
    algorithm: str | None = None,
    worlds: ArrayLike | None = None,
    ordered: bool = True,
    limit: int | None = None,
) -> NDArray[np.uint32]: ...
def pairs_between(
    a: ArrayLike,
    b: ArrayLike,
    *,
    groups: _Pair | None = None,
    masks: _Pair | None = None,
    owner: _Pair | None = None,
    fixed: _Pair | None = None,
    margin: float = 0.0,
    algorithm: str | None = None,
    worlds: tuple[ArrayLike, ArrayLike] | None = None,
    ordered: bool = True,
    limit: int | None = None,
) -> NDArray[np.uint32]: ...
def last_decision() -> Decision | None: ...
def predict(*, cache: str | PathLike[str] | Literal[False] | None = None, seconds: float = 2.0) -> Tuning: ...
def measure_hardware(
    quick: bool, progress: Callable[[int, int, str], object] | None
) -> tuple[dict[str, str], list[dict[str, Any]]]: ...
def restored_space(
    snapshot: bytes, tuning: Tuning, threads: int | None, learning: bool, exploring: bool, limit: int | None
) -> Space: ...

@final
class Decision:
    @property
    def algorithm(self) -> str: ...
    @property
    def reason(self) -> str: ...
    @property
    def source(self) -> str: ...
    @property
    def expected_ns(self) -> float | None: ...
    @property
    def measured_ns(self) -> float | None: ...
    @property
    def runner_up(self) -> tuple[str, float] | None: ...
    @property
    def load(self) -> dict[str, float]: ...

@final
class Tuning:
    @property
    def source(self) -> str: ...
    @property
    def model(self) -> str | None: ...
    @property
    def extrapolated(self) -> bool: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def scenario(self) -> str: ...
    @property
    def algorithms(self) -> list[str]: ...
    @property
    def fields(self) -> list[tuple[int, str]]: ...
    @property
    def crossovers(self) -> list[dict[str, Any]]: ...
    @property
    def setup(self) -> dict[str, Any] | None: ...
    def costs(
        self,
        objects: int,
        *,
        pairs: float = 0.0,
        axis_candidates: float | None = None,
        strip_candidates: float | None = None,
        moved: float = 1.0,
        moved_share: float | None = None,
    ) -> dict[str, float]: ...
    def costs_of(
        self, boxes: ArrayLike, upper: ArrayLike | None = None, *, moved: float = 1.0, moved_share: float | None = None
    ) -> dict[str, float]: ...
    def to_json(self) -> str: ...
    @staticmethod
    def from_json(text: str) -> Tuning: ...

@final
class BroadPhase:
    def __new__(
        cls,
        *,
        cache: str | PathLike[str] | Literal[False] | None = None,
        measure: bool = True,
        background: bool = True,
        tuning: Tuning | None = None,
        algorithm: str | None = None,
        threads: int | None = None,
        learning: bool = True,
        exploring: bool = True,
        ordered: bool = True,
        limit: int | None = None,
    ) -> BroadPhase: ...
    def find(
        self, boxes: ArrayLike, upper: ArrayLike | None = None, *, ids: ArrayLike | Sequence[int] | None = None
    ) -> NDArray[np.uint32]: ...
    def set_filter(
        self,
        *,
        groups: ArrayLike | None = None,
        masks: ArrayLike | None = None,
        owner: ArrayLike | None = None,
        fixed: ArrayLike | None = None,
    ) -> None: ...
    def begun(self) -> NDArray[np.uint32] | NDArray[np.int64]: ...
    def ended(self) -> NDArray[np.uint32] | NDArray[np.int64]: ...
    @property
    def last_decision(self) -> Decision | None: ...
    @property
    def tuning(self) -> Tuning: ...
    @property
    def setup(self) -> dict[str, Any]: ...
    @property
    def closed(self) -> bool: ...
    def save(self) -> bool: ...
    def close(self) -> None: ...
    def __enter__(self) -> BroadPhase: ...
    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> bool: ...

@disjoint_base
class View:
    def query_box(self, box: ArrayLike) -> NDArray[np.uint64]: ...
    def query_boxes(self, boxes: ArrayLike) -> tuple[NDArray[np.int64], NDArray[np.uint64]]: ...
    def query_point(self, point: ArrayLike) -> NDArray[np.uint64]: ...
    def cast_ray(
        self, origin: ArrayLike, direction: ArrayLike, max: float | None = None
    ) -> tuple[NDArray[np.uint64], NDArray[np.float32]]: ...
    def cast_rays(
        self, origins: ArrayLike, directions: ArrayLike, max: ArrayLike | None = None
    ) -> tuple[NDArray[np.int64], NDArray[np.uint64], NDArray[np.float32]]: ...
    def first_hits(
        self, origins: ArrayLike, directions: ArrayLike, max: ArrayLike | None = None
    ) -> tuple[NDArray[np.uint64], NDArray[np.float32]]: ...
    def cast_box(self, box: ArrayLike, motion: ArrayLike) -> tuple[NDArray[np.uint64], NDArray[np.float32]]: ...
    def nearest(self, point: ArrayLike, k: int) -> tuple[NDArray[np.uint64], NDArray[np.float32]]: ...

@final
class Space(View):
    def __new__(
        cls,
        *,
        cache: str | PathLike[str] | Literal[False] | None = None,
        measure: bool = True,
        background: bool = True,
        tuning: Tuning | None = None,
        algorithm: str | None = None,
        threads: int | None = None,
        learning: bool = True,
        exploring: bool = True,
        limit: int | None = None,
    ) -> Space: ...
    def insert(
        self,
        boxes: ArrayLike,
        *,
        groups: ArrayLike | None = None,
        masks: ArrayLike | None = None,
        owner: ArrayLike | None = None,
        fixed: ArrayLike | None = None,
    ) -> NDArray[np.uint64]: ...
    def set(self, handles: ArrayLike, boxes: ArrayLike) -> None: ...
    def set_body(
        self,
        handles: ArrayLike,
        *,
        groups: ArrayLike | None = None,
        masks: ArrayLike | None = None,
        owner: ArrayLike | None = None,
        fixed: ArrayLike | None = None,
    ) -> None: ...
    def remove(self, handles: ArrayLike) -> None: ...
    def update(self) -> None: ...
    def pairs(self) -> NDArray[np.uint64]: ...
    def begun(self) -> NDArray[np.uint64]: ...
    def ended(self) -> NDArray[np.uint64]: ...
    def handles(self) -> NDArray[np.uint64]: ...
    def boxes(self, handles: ArrayLike) -> NDArray[np.float32]: ...
    def view(
        self,
        *,
        groups: int | None = None,
        masks: int | None = None,
        owner: int | None = None,
        fixed: bool | None = None,
    ) -> View: ...
    @property
    def last_decision(self) -> Decision | None: ...
    @property
    def tuning(self) -> Tuning: ...
    @property
    def setup(self) -> dict[str, Any]: ...
    @property
    def closed(self) -> bool: ...
    def save(self) -> bool: ...
    def close(self) -> None: ...
    def __len__(self) -> int: ...
    def __contains__(self, handle: int, /) -> bool: ...
    def __enter__(self) -> Space: ...
    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> bool: ...
