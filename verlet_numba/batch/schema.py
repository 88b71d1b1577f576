"""What a sweep file may say."""

from collections.abc import Iterable
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from verlet_numba.scene.schema_common import Finding, Integer, Number, Part, Whole
from verlet_numba.study import figures

Method = Literal["grid", "zip", "random", "lhs", "sobol"]
Samples = Annotated[Integer, Field(ge=1, le=1_000_000)]
MAX_VALUES = 100_000


class Parameter(Part):
    """What a key of the scene is varied over: a list of values, or a range of numbers."""

    values: Annotated[tuple[Any, ...], Field(min_length=1, max_length=MAX_VALUES)] | None = Field(
        default=None, description="the values, of any kind")
    min: Number | None = Field(default=None, description="lower end of a range")
    max: Number | None = Field(default=None, description="upper end of a range")
    distribution: Literal["uniform", "log_uniform"] = Field(
        default="uniform", description="of a range: equal weight to equal differences, or to equal ratios")

    def findings(self) -> Iterable[Finding]:
        if (self.values is None) == (self.min is None and self.max is None):
            yield (), "needs either `values`, a list, or `min` and `max`"
        elif self.values is None and (self.min is None or self.max is None):
            yield (), "a range needs `min` and `max`"
        elif self.min is not None and self.max is not None and self.max <= self.min:
            yield ("max",), f"{self.max:g} is not above the lower end, {self.min:g}"
        elif self.distribution == "log_uniform" and self.min is not None and self.min <= 0:
            yield ("min",), f"must be above 0 for equal weight to equal ratios, not {self.min:g}"

    @property
    def ranged(self) -> bool:
        return self.values is None


def _spelt(value: Any) -> Any:
    """A list alone is one of values."""
    return {"values": value} if isinstance(value, list) else value


class Sweep(Part):
    """Many runs of one scene."""

    version: Literal[1] = Field(description="version of the format of sweep files: 1")
    scene: Annotated[str, Field(min_length=1, max_length=10_000)] = Field(description="scene file, relative to this file")
    method: Method | None = Field(
        default=None, description="grid: every combination; zip: first values together, then second ...; random; lhs: Latin "
                                  "hypercube; sobol: scrambled Sobol points. If left out: lhs where there is a range, else grid")
    samples: Samples | None = Field(default=None, description="runs of random, lhs, sobol; steps of a range in grid and zip")
    seed: Whole = Field(default=0, description="of random, lhs and sobol")
    parameters: Annotated[dict[str, Annotated[Parameter, BeforeValidator(_spelt)]], Field(min_length=1, max_length=1000)] = Field(
        description="dotted path of a key -> what it is varied over")
    measures: tuple[str, ...] = Field(
        default=figures.USUAL, description="columns of the table: measures, or MEASURE.last and the like")

    @property
    def way(self) -> str:
        """The method, chosen where none is named."""
        return self.method or ("lhs" if any(parameter.ranged for parameter in self.parameters.values()) else "grid")

    def findings(self) -> Iterable[Finding]:
        for row, name in enumerate(self.measures):
            if reason := figures.wrong(name):
                yield ("measures", row), reason + _near(name)
        if len(set(self.measures)) < len(self.measures):
            yield ("measures",), "names one twice"
        for path in self.parameters:
            if "" in path.split("."):
                yield ("parameters", path), "write a dotted path, such as bodies.crate.mass"
        if self.samples is None:
            yield from self._needs_samples()
        if self.way == "zip":
            yield from self._unequal()

    def _needs_samples(self) -> Iterable[Finding]:
        if self.way in ("random", "lhs", "sobol"):
            yield ("parameters",), f"method {self.way} needs `samples` (--samples N), how many runs there are"
        else:
            for path, parameter in self.parameters.items():
                if parameter.ranged:
                    message = f"a range needs `samples` (--samples N), how many steps method {self.way} makes of it"
                    yield ("parameters", path), message

    def _unequal(self) -> Iterable[Finding]:
        lengths = {path: len(parameter.values) for path, parameter in self.parameters.items() if parameter.values is not None}
        ranged = len(lengths) < len(self.parameters)
        wanted = self.samples if ranged and self.samples is not None else next(iter(lengths.values()), 0)
        for path, length in lengths.items():
            if length != wanted:
                yield ("parameters", path), f"has {length} values where others have {wanted}: method zip takes them side by side"


def _near(name: str) -> str:
    from verlet_numba.scene.messages import did_you_mean
    from verlet_numba.study.measures import UNITS

    return did_you_mean(name.partition(".")[0], UNITS)
