# SPDX-License-Identifier: GPL-3.0-or-later
"""What operators share: polls, how they report, and jobs behind a progress bar that Esc stops."""

from __future__ import annotations

import time
from collections.abc import Generator
from typing import Any

import bpy

from ...blender.material.scatter_distance import overridden
from ...blender.material.translucent import active_translucent_material, translucent_objects
from ...blender.report import Report
from ...blender.setup import Setup
from ...core.errors import CdrfError
from ...core.progress import in_words

# A smaller mesh is done in under half a second: too short for a progress bar.
MODAL_FROM_VERTICES = 15_000


def in_object_mode(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Whether Blender is in Object Mode; if not, set the operator's poll message."""
    if context.mode != "OBJECT":
        operator.poll_message_set("Go to Object Mode first (Tab)")
        return False
    return True


def any_translucent(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Whether the view layer has a translucent object; if not, set the operator's poll message."""
    if not translucent_objects(context.view_layer):
        operator.poll_message_set("Nothing is translucent yet: press Make Translucent first")
        return False
    return True


def refuse(operator: bpy.types.Operator, error: Exception | str) -> set[str]:
    """Report why the operator cannot run, and cancel it."""
    operator.report({"ERROR"}, str(error).strip())
    return {"CANCELLED"}


def report_setup(operator: bpy.types.Operator, report: Report) -> None:
    """Show the warnings of a setup, then its summary."""
    for line in report.warnings:
        operator.report({"WARNING"}, line)
    operator.report({"INFO"}, f"CDRF: {report.sentence()}")


def warn_if_overridden(operator: bpy.types.Operator, material: bpy.types.Material) -> None:
    """Warn where a keyframe or a link decides the scatter distance, whatever was set."""
    warning = overridden(material)
    if warning:
        operator.report({"WARNING"}, warning)


class OnTranslucentMaterial(bpy.types.Operator):
    """An operator on the active translucent material; never registered itself."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        material = active_translucent_material(context.object)
        if material is None:
            cls.poll_message_set("Make the object translucent first")
            return False
        if not material.is_editable:
            cls.poll_message_set("The material is linked from another file: make it local first")
            return False
        return True

    def material(self, context: bpy.types.Context) -> bpy.types.Material:
        """Return the material that `poll` found."""
        found = active_translucent_material(context.object)
        assert found is not None
        return found


class StepByStep(bpy.types.Operator):
    """Runs a generator of (part done, what is being done); never registered itself.

    Set `_steps` and return `begin(context)`; what the generator returns goes to `finish`.
    """

    TICK_SECONDS = 0.05
    WHILE_WAITING = "RUNNING_MODAL"
    """PASS_THROUGH where the artist may go on working meanwhile."""

    _steps: Generator[tuple[float, str], None, Any]
    _timer: bpy.types.Timer
    _start: float

    def begin(self, context: bpy.types.Context) -> set[str]:
        """Show the progress bar and do a step at every tick of a timer."""
        self._start = time.monotonic()
        manager = context.window_manager
        manager.progress_begin(0.0, 1.0)
        self._timer = manager.event_timer_add(self.TICK_SECONDS, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def finish(self, context: bpy.types.Context, result: Any) -> set[str]:
        """Write the result.

        Raises:
            CdrfError: It cannot be written.
        """
        raise NotImplementedError

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Do the next step, or stop."""
        if event.type == "ESC":
            self._end_modal(context)
            self.report({"WARNING"}, "Stopped; nothing was changed.")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {self.WHILE_WAITING}
        try:
            part, what = next(self._steps)
        except StopIteration as end:
            self._end_modal(context)
            return self.finish_or_refuse(context, end.value)
        except CdrfError as error:
            self._end_modal(context)
            return refuse(self, error)
        context.window_manager.progress_update(part)
        progress = in_words(part, time.monotonic() - self._start)
        context.workspace.status_text_set(f"CDRF: {what}, {progress}   (Esc stops)")
        return {"RUNNING_MODAL"}

    def finish_or_refuse(self, context: bpy.types.Context, result: Any) -> set[str]:
        """Finish, or report why not."""
        try:
            return self.finish(context, result)
        except CdrfError as error:
            return refuse(self, error)

    def cancel(self, context: bpy.types.Context) -> None:
        """Stop, because Blender is closing or opening another file."""
        self._end_modal(context)

    def _end_modal(self, context: bpy.types.Context) -> None:
        self._steps.close()
        manager = context.window_manager
        manager.event_timer_remove(self._timer)
        manager.progress_end()
        context.workspace.status_text_set(None)


class SetupOperator(StepByStep):
    """Runs a Setup: at once in a script, behind a progress bar for a person with a large mesh.

    Never registered itself.
    """

    _job: Setup

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return in_object_mode(cls, context)

    def make_job(self, context: bpy.types.Context) -> Setup:
        """Gather what to set up, from the context and the operator's properties.

        Raises:
            CdrfError: There is nothing to set up, or something may not be changed.
        """
        raise NotImplementedError

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            self._job = self.make_job(context)
            for _ in self._job.steps():
                pass
        except CdrfError as error:
            return refuse(self, error)
        return self.finish_or_refuse(context, None)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        try:
            self._job = self.make_job(context)
        except CdrfError as error:
            return refuse(self, error)
        if self._evaluated_vertices(context) < MODAL_FROM_VERTICES:
            return self.execute(context)
        self._steps = self._job.steps()
        return self.begin(context)

    def _evaluated_vertices(self, context: bpy.types.Context) -> int:
        depsgraph = context.evaluated_depsgraph_get()
        return sum(
            len(work.users[0].evaluated_get(depsgraph).data.vertices) for work in self._job.work
        )

    def finish(self, _context: bpy.types.Context, _result: Any) -> set[str]:
        report_setup(self, self._job.commit())
        return {"FINISHED"}
