# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that take their time: a progress bar, the time that is left, and Esc."""

from __future__ import annotations

import time
from collections.abc import Generator
from typing import Any

import bpy

from ...core.errors import CdrfError
from ...core.progress import in_words


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
        """Bring the progress bar up and go on at every tick."""
        self._start = time.monotonic()
        manager = context.window_manager
        manager.progress_begin(0.0, 1.0)
        self._timer = manager.event_timer_add(self.TICK_SECONDS, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def finish(self, context: bpy.types.Context, result: Any) -> set[str]:
        """Write what was worked out.

        Raises:
            CdrfError: It cannot be written.
        """
        raise NotImplementedError

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Do the next step, or stop."""
        if event.type == "ESC":
            self._leave_modal(context)
            self.report({"WARNING"}, "Stopped; nothing was changed.")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {self.WHILE_WAITING}
        try:
            part, what = next(self._steps)
        except StopIteration as end:
            self._leave_modal(context)
            return self.finish_or_say(context, end.value)
        except CdrfError as error:
            self._leave_modal(context)
            return self.refuse(error)
        context.window_manager.progress_update(part)
        far = in_words(part, time.monotonic() - self._start)
        context.workspace.status_text_set(f"CDRF: {what}, {far}   (Esc stops)")
        return {"RUNNING_MODAL"}

    def finish_or_say(self, context: bpy.types.Context, result: Any) -> set[str]:
        """Finish, or say in words why not."""
        try:
            return self.finish(context, result)
        except CdrfError as error:
            return self.refuse(error)

    def refuse(self, error: CdrfError) -> set[str]:
        """Report an error's sentence and leave everything as it is."""
        self.report({"ERROR"}, str(error))
        return {"CANCELLED"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender is closing, or another file is opened."""
        self._leave_modal(context)

    def _leave_modal(self, context: bpy.types.Context) -> None:
        self._steps.close()
        manager = context.window_manager
        manager.event_timer_remove(self._timer)
        manager.progress_end()
        context.workspace.status_text_set(None)
