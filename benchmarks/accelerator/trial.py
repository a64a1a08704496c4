"""What is tried, in the order in which it matters should the time run out."""

from collections.abc import Iterable, Iterator, Sequence

from msgspec import Struct

from benchmarks.accelerator.differences import Difference, differences
from benchmarks.accelerator.engines import ENGINES, cpu_engine
from benchmarks.accelerator.jobs import Jobs, Missing
from benchmarks.accelerator.measured import Measured, load_arrays
from benchmarks.accelerator.places import Place
from benchmarks.accelerator.tables import Row
from orchestrator.report import TrainingReport

_AGAIN = "-again"


class Attempt(Struct, frozen=True):
    """One measurement: what it is called, which module does it, where, and with which options.

    Attributes:
        name: of its files.
        title: for people.
        note: what to say with its stages.
    """

    name: str
    title: str
    module: str
    place: Place
    options: tuple[str, ...]
    note: str = ""


class Trial:
    """All measurements at both places."""

    def __init__(self, jobs: Jobs, cpu: Place, gpu: Place, *, frames: int, updates: int) -> None:
        self._jobs = jobs
        self._cpu = cpu
        self._gpu = gpu
        self._frames = ("--count", str(frames))
        self._updates = ("--count", str(updates))

    def rows(self) -> list[Row]:
        """Every stage at every place, first all of them, then all once more."""
        found: dict[str, tuple[Attempt, Measured | Missing]] = {}
        self._try(self._renderings(), found)
        drawn = [name for name, (_, one) in found.items() if isinstance(one, Measured)]
        self._try((*self._perceptions(drawn), *self._learnings()), found)
        return [
            Row(attempt.name, attempt.title, attempt.note, attempt.place.name, one, self._again(attempt, one))
            for attempt, one in found.values()
        ]

    def loops(self, steps: int, rows: Sequence[Row]) -> dict[str, TrainingReport | Missing]:
        """A short training with the renderer and the network at each place; the agent learns on the CPU."""
        found = {self._cpu.name: self._trained(self._cpu, cpu_engine(), steps)}
        used = (f"render-{self._gpu.name}", f"perceive-{self._gpu.name}-onnxruntime-")
        if any(row.name.startswith(used) and isinstance(row.found, Measured) for row in rows):
            return found | {self._gpu.name: self._trained(self._gpu, "auto", steps)}
        return found | {self._gpu.name: Missing("there is no GPU")}

    def _trained(self, place: Place, backend: str, steps: int) -> TrainingReport | Missing:
        config = f'[training]\nsteps = {steps}\nprefill = 300\n[perception]\nbackend = "{backend}"\n'
        return self._jobs.train(f"loop-{place.name}", place, config)

    def differences(self, rows: Sequence[Row]) -> Iterator[tuple[str, list[Difference]]]:
        """From the CPU's, of every kind; and from the first time, where the bytes were not the same again."""
        measured = [row for row in rows if isinstance(row.found, Measured)]
        for kind in ("render", "perceive"):
            same_kind = [row for row in measured if row.name.startswith(kind)]
            for row in same_kind[1:]:
                yield _called(row), self._apart(same_kind[0].name, row.name)
        for row in measured:
            found, again = row.found, row.again
            if isinstance(found, Measured) and isinstance(again, Measured) and again.digests != found.digests:
                yield f"{_called(row)}: again, against the first time", self._apart(row.name, row.name + _AGAIN)

    def _try(self, attempts: Iterable[Attempt], found: dict[str, tuple[Attempt, Measured | Missing]]) -> None:
        for attempt in attempts:
            found[attempt.name] = attempt, self._measured(attempt, attempt.name)

    def _again(self, attempt: Attempt, found: Measured | Missing) -> Measured | Missing:
        return found if isinstance(found, Missing) else self._measured(attempt, attempt.name + _AGAIN)

    def _measured(self, attempt: Attempt, name: str) -> Measured | Missing:
        return self._jobs.measure(name, attempt.module, attempt.place, *attempt.options)

    def _apart(self, expected: str, found: str) -> list[Difference]:
        return differences(load_arrays(self._jobs.arrays(expected)), load_arrays(self._jobs.arrays(found)))

    def _renderings(self) -> Iterator[Attempt]:
        for place in (self._cpu, self._gpu):
            yield Attempt(f"render-{place.name}", "render", "render", place, self._frames)

    def _perceptions(self, drawn: Sequence[str]) -> Iterator[Attempt]:
        """The network everywhere on the same frames, the CPU's if there are any; then all of a look on the GPU."""
        if not drawn:
            return
        tried = [(self._cpu, cpu_engine()), *((self._gpu, engine) for engine in ENGINES if engine != "openvino")]
        for place, engine in tried:
            yield self._perception(place, engine, drawn[0])
        if drawn[0] != drawn[-1]:
            yield self._perception(self._gpu, "onnxruntime", drawn[-1])

    def _perception(self, place: Place, engine: str, frames: str) -> Attempt:
        options = ("--device", engine, "--frames", str(self._jobs.arrays(frames)), *self._frames)
        whose = frames.removeprefix("render-")
        note = f", {whose}'s frames" if whose != "CPU" else ""
        return Attempt(
            f"perceive-{place.name}-{engine}-{whose}", f"perceive by {engine}{note}", "perceive", place, options, note
        )

    def _learnings(self) -> Iterator[Attempt]:
        for place, device in ((self._cpu, "cpu"), (self._gpu, "cuda")):
            yield Attempt(f"learn-{place.name}", "learn", "learn", place, ("--device", device, *self._updates))


def _called(row: Row) -> str:
    return f"{row.title} on the {row.place}"
