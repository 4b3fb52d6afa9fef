"""Work as it runs in a window: the operator's own steps, with what an artist does in between."""

import time
from collections.abc import Callable
from types import FunctionType, MethodType, SimpleNamespace
from typing import Any

import bpy
from tracking import module

TIMER, ESC = (SimpleNamespace(type=kind, value="PRESS") for kind in ("TIMER", "ESC"))
# More steps than any work here takes.
MANY = 2000


class Heard:
    """An operator as itself, but for what it reports, which Blender would show and forget."""

    def __init__(self, operator: Any, said: list[str]) -> None:
        vars(self).update(operator=operator, report=lambda _level, text: said.append(text))

    def __getattr__(self, name: str) -> Any:
        work = getattr(type(self.operator), name, None)
        return MethodType(work, self) if isinstance(work, FunctionType) else getattr(self.operator, name)

    def __setattr__(self, name: str, value: Any) -> None:
        setattr(self.operator, name, value)


class Run:
    """An operator that runs, and what it has said."""

    def __init__(self, operator: Any) -> None:
        self.operator, self.said = operator, list[str]()

    def step(self, event: Any = TIMER) -> set[str]:
        """What Blender does at every tick of the timer; a step that changes data is one of undo."""
        ended = Heard(self.operator, self.said).modal(bpy.context, event)
        if "FINISHED" in ended:
            bpy.ops.ed.undo_push(message=self.operator.bl_label)
        return ended

    def end(self, pause_s: float = 0.0) -> set[str]:
        """All its steps, with a pause before each as the timer has it."""
        for _ in range(MANY):
            time.sleep(pause_s)
            if (ended := self.step()) != {"RUNNING_MODAL"}:
                return ended
        raise AssertionError("the work does not end")


def begun(monkeypatch: Any, button: Callable[..., set[str]], **options: Any) -> Run:
    """Press a button; gives the work that runs then. The module `bpy` would wait for the work's end instead."""
    modal, started = module("modal"), []

    def execute(operator: Any, context: Any) -> set[str]:
        started.append(Run(operator))
        return operator.invoke(context, None)

    with monkeypatch.context() as changed:
        app = SimpleNamespace(background=False)
        changed.setattr(modal, "bpy", SimpleNamespace(app=app, data=bpy.data, ops=bpy.ops, types=bpy.types))
        changed.setattr(modal.WorkOperator, "execute", execute)
        assert button(**options) == {"RUNNING_MODAL"}
    (run,) = started
    return run
