"""The measurements that are made at both places."""

from collections.abc import Collection, Iterable, Iterator

from msgspec import Struct

from benchmarks.accelerator.differences import Difference, differences
from benchmarks.accelerator.engines import cpu_engine
from benchmarks.accelerator.jobs import Jobs, Missing
from benchmarks.accelerator.measured import Measured, load_arrays
from benchmarks.accelerator.places import Place
from benchmarks.accelerator.tables import Row
from orchestrator.monitoring.report import TrainingReport

KINDS = ("render", "perceive", "learn", "loop")
"""The names of the measurements."""

_IN_DOUBT = ("perceive", "learn", "render")
"""Modules, the one first whose bytes are the least sure to come again."""

_AGAIN = "-again"

_PREFILL = 264
"""Steps: the first batch and one step of every drone."""

_LONGEST_LOOP = 35.0
"""Seconds, start included. A training that takes longer is asked to end, and tells what it came to until then."""


class Attempt(Struct, frozen=True):
    """One measurement: what it is called, which module does it, where, and with which options.

    Attributes:
        name: of its files.
        title: for people.
        note: what to say with its stages.
        engine: that perceives.
    """

    name: str
    title: str
    module: str
    place: Place
    options: tuple[str, ...]
    note: str = ""
    engine: str = ""


class Trial:
    """Measurements at both places.

    Args:
        only: the kinds that are asked for, of `KINDS`. What these need of others is measured once.
    """

    def __init__(
        self, jobs: Jobs, cpu: Place, gpu: Place, *, frames: int, updates: int, only: Collection[str] = KINDS
    ) -> None:
        self._jobs = jobs
        self._cpu = cpu
        self._gpu = gpu
        self._only = only
        self._frames = ("--count", str(frames))
        self._updates = ("--count", str(updates))
        self._found: dict[str, tuple[Attempt, Measured | Missing]] = {}
        self._again: dict[str, Measured | Missing] = {}

    def measure(self) -> None:
        """Every stage once at both places."""
        if set(self._only) - {"learn"}:
            # Perception needs frames, and a training a GPU that draws.
            self._try(self._renderings())
        if "perceive" in self._only:
            self._try(self._perceptions())
        if "learn" in self._only:
            self._try(self._learnings())

    def repeat(self) -> None:
        """Every stage once more, on the GPU first: whether the same bytes come is known of the CPU."""
        asked = [attempt for attempt, _ in self._found.values() if attempt.module in self._only]
        for attempt in sorted(asked, key=lambda one: (one.place == self._cpu, _IN_DOUBT.index(one.module))):
            if isinstance(self._found[attempt.name][1], Measured):
                self._again[attempt.name] = self._measured(attempt, attempt.name + _AGAIN)

    def perceive_gpu_frames(self) -> None:
        """All of a look on the GPU: what it draws, perceived there."""
        if "perceive" in self._only and self._measured_of("render", self._gpu):
            self._try([self._perception(self._gpu, self._gpu_engine(), f"render-{self._gpu.name}")])

    def rows(self) -> list[Row]:
        """The results so far."""
        never = Missing("it was not asked for")
        return [
            Row(attempt.name, attempt.title, attempt.note, attempt.place.name, one, self._again.get(name, never))
            for name, (attempt, one) in self._found.items()
        ]

    def loops(self, steps: int) -> dict[str, TrainingReport | Missing]:
        """A short training with the renderer and the network at each place; the agent learns on the CPU."""
        if "loop" not in self._only:
            return {}
        there = self._measured_of("render", self._gpu) or self._measured_of("perceive", self._gpu)
        # On the GPU first: of the CPU's more is known.
        on_gpu = self._trained(self._gpu, "auto", steps) if there else Missing("there is no GPU")
        return {self._cpu.name: self._trained(self._cpu, cpu_engine(), steps), self._gpu.name: on_gpu}

    def differences(self) -> Iterator[tuple[str, list[Difference]]]:
        """From the CPU's, of every kind; and from the first time, where the bytes were not the same again."""
        for kind in ("render", "perceive"):
            expected = self._measured_of(kind, self._cpu)
            for attempt in self._measured_of(kind, self._gpu) if expected else ():
                yield _called(attempt), self._apart(expected[0].name, attempt.name)
        for name, again in self._again.items():
            attempt, found = self._found[name]
            if isinstance(found, Measured) and isinstance(again, Measured) and again.digests != found.digests:
                yield f"{_called(attempt)}: again, against the first time", self._apart(name, name + _AGAIN)

    def _trained(self, place: Place, backend: str, steps: int) -> TrainingReport | Missing:
        config = f'[training]\nsteps = {steps}\nprefill = {_PREFILL}\n[perception]\nbackend = "{backend}"\n'
        return self._jobs.train(f"loop-{place.name}", place, config, longest=_LONGEST_LOOP)

    def _try(self, attempts: Iterable[Attempt]) -> None:
        for attempt in attempts:
            self._found[attempt.name] = attempt, self._measured(attempt, attempt.name)

    def _measured(self, attempt: Attempt, name: str) -> Measured | Missing:
        return self._jobs.measure(name, attempt.module, attempt.place, *attempt.options)

    def _measured_of(self, module: str, place: Place) -> list[Attempt]:
        """The results of this module at this place."""
        return [
            attempt
            for attempt, one in self._found.values()
            if attempt.module == module and attempt.place == place and isinstance(one, Measured)
        ]

    def _apart(self, expected: str, found: str) -> list[Difference]:
        return differences(load_arrays(self._jobs.arrays(expected)), load_arrays(self._jobs.arrays(found)))

    def _renderings(self) -> Iterator[Attempt]:
        for place in (self._cpu, self._gpu):
            yield Attempt(f"render-{place.name}", "render", "render", place, self._frames)

    def _perceptions(self) -> Iterator[Attempt]:
        """The network at both places on the same frames, the CPU's if there are any; on PyTorch for want of better."""
        drawn = self._measured_of("render", self._cpu) or self._measured_of("render", self._gpu)
        if not drawn:
            return
        yield self._perception(self._cpu, cpu_engine(), drawn[0].name)
        yield self._perception(self._gpu, "onnxruntime", drawn[0].name)
        if not self._measured_of("perceive", self._gpu):
            yield self._perception(self._gpu, "torch", drawn[0].name)

    def _gpu_engine(self) -> str:
        """The one that the network was measured with on the GPU."""
        return next((attempt.engine for attempt in self._measured_of("perceive", self._gpu)), "onnxruntime")

    def _perception(self, place: Place, engine: str, frames: str) -> Attempt:
        options = ("--device", engine, "--frames", str(self._jobs.arrays(frames)), *self._frames)
        whose = frames.removeprefix("render-")
        note = f", {whose}'s frames" if whose != "CPU" else ""
        name, title = f"perceive-{place.name}-{engine}-{whose}", f"perceive by {engine}{note}"
        return Attempt(name, title, "perceive", place, options, note, engine)

    def _learnings(self) -> Iterator[Attempt]:
        for place, device in ((self._cpu, "cpu"), (self._gpu, "cuda")):
            yield Attempt(f"learn-{place.name}", "learn", "learn", place, ("--device", device, *self._updates))


def _called(attempt: Attempt) -> str:
    return f"{attempt.title} on the {attempt.place.name}"
