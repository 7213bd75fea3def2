"""What a service is doing."""

from __future__ import annotations

from tactus_client import html, messages


class Status:
    """What the service said of itself. Fields that are messages have the names of ``tactus.v1.CommandReply``, which ``reply`` is."""

    def __init__(self, reply: messages.CommandReply):
        self.reply = reply
        self.rig = reply.rig
        self.version = reply.version
        #: ``RunState``: of the present run, or of the last one.
        self.state = reply.state
        #: ``StageState`` and ``Health``.
        self.stage = reply.stage
        self.health = reply.health
        #: Who holds the lease; empty if nobody does.
        self.lease_holder = reply.health.lease_holder
        #: Thickness of the covering in place, and the greatest depth that the envelope allows under it.
        self.covering_mm = reply.covering_mm
        self.depth_max_mm = reply.depth_max_mm
        #: ``RigDescription``: where elements are, limits, the tool.
        self.description = reply.description
        #: ``SafetyEvent``: what the safety supervisor did last; None if it did nothing since the start of the service.
        self.safety = reply.safety if reply.HasField("safety") else None
        #: Folder of recordings, on the service's machine.
        self.recordings = reply.recordings
        self.simulated = reply.health.simulated
        #: What wants a reset before a run can start; empty if nothing does.
        self.fault = reply.state.fault

    @property
    def phase(self) -> str:
        """``idle``, ``preparing``, ``running``, ``paused``, ``stopping`` or ``finished``."""
        return messages.word_of(self.state, "phase")

    def __repr__(self) -> str:
        simulated = ", SIMULATED" if self.simulated else ""
        fault = f", needs a reset: {self.fault}" if self.fault else ""
        return f"<Status of {self.rig}{simulated}: {self.phase}{fault}>"

    def _repr_html_(self) -> str:
        stage = self.stage
        facts = {
            "run": f"{self.phase} {self.state.run_id}",
            "sensor": f"{self.health.frame_rate_hz:.1f} Hz" if self.health.sensor_connected else "not connected",
            "stage": f"{messages.word_of(stage, 'status')} at {stage.x_mm:.3f}, {stage.y_mm:.3f}, {stage.z_mm:.3f} mm",
            "covering": f"{self.covering_mm:.3f} mm, depth up to {self.depth_max_mm:.3f} mm",
            "lease": self.lease_holder or "free",
            "version": self.version,
        }
        warnings = [f"needs a reset: {self.fault}"] if self.fault else []
        if self.safety is not None:
            warnings.append(f"{messages.word_of(self.safety, 'verdict')} by {self.safety.rule}: {self.safety.detail}")
        return html.card(f"Rig {self.rig}", facts, self.simulated, warnings)
