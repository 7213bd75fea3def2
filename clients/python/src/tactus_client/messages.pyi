"""Types of the messages of ``tactus.v1``. Written by make_stub.py."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import DecodeError as DecodeError
from google.protobuf.message import Message

PACKAGE: str
POOL: DescriptorPool

def encoding(message_class: type[Message]) -> str: ...
def name_of(message: Message, field: str) -> str: ...
def word_of(message: Message, field: str) -> str: ...
def to_dict(message: Message) -> dict[str, Any]: ...
def is_repeated(field: Any) -> bool: ...

class Cleanup(Message):
    retracted: bool
    z_mm: float
    detail: str
    def __init__(self, *, retracted: bool | None = ..., z_mm: float | None = ..., detail: str | None = ...) -> None: ...

class CommandReply(Message):
    ok: bool
    error: str
    exit_code: int
    state: RunState
    rig: str
    version: str
    stage: StageState
    health: Health
    lease: Lease
    note: str
    rig_toml: str
    covering_mm: float
    depth_max_mm: float
    safety: SafetyEvent
    description: RigDescription
    experiments: Sequence[Experiment]
    plan: Plan
    recordings: str
    def __init__(self, *, ok: bool | None = ..., error: str | None = ..., exit_code: int | None = ..., state: RunState | None = ..., rig: str | None = ..., version: str | None = ..., stage: StageState | None = ..., health: Health | None = ..., lease: Lease | None = ..., note: str | None = ..., rig_toml: str | None = ..., covering_mm: float | None = ..., depth_max_mm: float | None = ..., safety: SafetyEvent | None = ..., description: RigDescription | None = ..., experiments: Iterable[Experiment] | None = ..., plan: Plan | None = ..., recordings: str | None = ...) -> None: ...

class CommandRequest(Message):
    who: str
    reason: str
    abort: bool
    lease: bytes
    covering_mm: float
    def __init__(self, *, who: str | None = ..., reason: str | None = ..., abort: bool | None = ..., lease: bytes | None = ..., covering_mm: float | None = ...) -> None: ...

class CoveringChanged(Message):
    covering_mm: float
    def __init__(self, *, covering_mm: float | None = ...) -> None: ...

class DwellDone(Message):
    press: int
    dwell: int
    x_mm: float
    y_mm: float
    depth_mm: float
    frames: int
    mean_counts: Sequence[float]
    from_mono_ns: int
    to_mono_ns: int
    def __init__(self, *, press: int | None = ..., dwell: int | None = ..., x_mm: float | None = ..., y_mm: float | None = ..., depth_mm: float | None = ..., frames: int | None = ..., mean_counts: Iterable[float] | None = ..., from_mono_ns: int | None = ..., to_mono_ns: int | None = ...) -> None: ...

class Experiment(Message):
    name: str
    doc: str
    parameters: Sequence[Parameter]
    error: str
    def __init__(self, *, name: str | None = ..., doc: str | None = ..., parameters: Iterable[Parameter] | None = ..., error: str | None = ...) -> None: ...

class Frame(Message):
    seq: int
    epoch: int
    device_tick: int
    t_mono_ns: int
    t_wall_ns: int
    counts: Sequence[float]
    flags: int
    lost_before: int
    simulated: bool
    bad_elements: Sequence[int]
    temperature_c: float
    def __init__(self, *, seq: int | None = ..., epoch: int | None = ..., device_tick: int | None = ..., t_mono_ns: int | None = ..., t_wall_ns: int | None = ..., counts: Iterable[float] | None = ..., flags: int | None = ..., lost_before: int | None = ..., simulated: bool | None = ..., bad_elements: Iterable[int] | None = ..., temperature_c: float | None = ...) -> None: ...

class Gap(Message):
    frames_lost: int
    after_seq: int
    next_seq: int
    reason: str
    def __init__(self, *, frames_lost: int | None = ..., after_seq: int | None = ..., next_seq: int | None = ..., reason: str | None = ...) -> None: ...

class Health(Message):
    t_mono_ns: int
    t_wall_ns: int
    version: str
    uptime_s: float
    sensor_connected: bool
    stage_connected: bool
    frames: int
    frames_lost: int
    frames_dropped_on_bus: int
    frame_rate_hz: float
    clock_offset_s: float
    clock_uncertainty_s: float
    simulated: bool
    lease_holder: str
    problem: str
    def __init__(self, *, t_mono_ns: int | None = ..., t_wall_ns: int | None = ..., version: str | None = ..., uptime_s: float | None = ..., sensor_connected: bool | None = ..., stage_connected: bool | None = ..., frames: int | None = ..., frames_lost: int | None = ..., frames_dropped_on_bus: int | None = ..., frame_rate_hz: float | None = ..., clock_offset_s: float | None = ..., clock_uncertainty_s: float | None = ..., simulated: bool | None = ..., lease_holder: str | None = ..., problem: str | None = ...) -> None: ...

class Lease(Message):
    holder: str
    expires_in_s: float
    lease: bytes
    def __init__(self, *, holder: str | None = ..., expires_in_s: float | None = ..., lease: bytes | None = ...) -> None: ...

class LeaseRequest(Message):
    action: int
    who: str
    reason: str
    lease: bytes
    def __init__(self, *, action: int | str | None = ..., who: str | None = ..., reason: str | None = ..., lease: bytes | None = ...) -> None: ...

class LeaseTaken(Message):
    by: str
    reason: str
    def __init__(self, *, by: str | None = ..., reason: str | None = ...) -> None: ...

class Log(Message):
    message: str
    def __init__(self, *, message: str | None = ...) -> None: ...

class Parameter(Message):
    name: str
    kind: str
    default_json: str
    doc: str
    unit: str
    choices_json: Sequence[str]
    min: float
    max: float
    def __init__(self, *, name: str | None = ..., kind: str | None = ..., default_json: str | None = ..., doc: str | None = ..., unit: str | None = ..., choices_json: Iterable[str] | None = ..., min: float | None = ..., max: float | None = ...) -> None: ...

class Paused(Message):
    by: str
    def __init__(self, *, by: str | None = ...) -> None: ...

class PhaseChanged(Message):
    phase: int
    press: int
    def __init__(self, *, phase: int | str | None = ..., press: int | None = ...) -> None: ...

class Plan(Message):
    exit_status: int
    message: str
    presses: int
    dwells: int
    duration_s: float
    deepest_mm: float
    depth_max_mm: float
    travel_mm: Sequence[float]
    seed: int
    parameters_json: str
    def __init__(self, *, exit_status: int | str | None = ..., message: str | None = ..., presses: int | None = ..., dwells: int | None = ..., duration_s: float | None = ..., deepest_mm: float | None = ..., depth_max_mm: float | None = ..., travel_mm: Iterable[float] | None = ..., seed: int | None = ..., parameters_json: str | None = ...) -> None: ...

class PressRepeated(Message):
    press: int
    reason: str
    def __init__(self, *, press: int | None = ..., reason: str | None = ...) -> None: ...

class ReadDone(Message):
    frames: int
    mean_counts: Sequence[float]
    from_mono_ns: int
    to_mono_ns: int
    def __init__(self, *, frames: int | None = ..., mean_counts: Iterable[float] | None = ..., from_mono_ns: int | None = ..., to_mono_ns: int | None = ...) -> None: ...

class ReferenceDone(Message):
    frames: int
    mean_counts: Sequence[float]
    from_mono_ns: int
    to_mono_ns: int
    def __init__(self, *, frames: int | None = ..., mean_counts: Iterable[float] | None = ..., from_mono_ns: int | None = ..., to_mono_ns: int | None = ...) -> None: ...

class Resumed(Message):
    by: str
    def __init__(self, *, by: str | None = ...) -> None: ...

class RigDescription(Message):
    col_centres_mm: Sequence[float]
    row_centres_mm: Sequence[float]
    element_mm: Sequence[float]
    origin_mm: Sequence[float]
    rotation_deg: float
    rate_hz: float
    full_scale_counts: float
    baseline_counts: Sequence[float]
    covering_mm: float
    indenter: str
    indenter_shape: str
    indenter_width_mm: float
    x_mm: Sequence[float]
    y_mm: Sequence[float]
    z_max_mm: float
    depth_max_mm: float
    element_max_counts: float
    sum_max_counts: float
    baseline_band_counts: float
    safe_height_mm: float
    approach_height_mm: float
    unwatched_elements: Sequence[int]
    def __init__(self, *, col_centres_mm: Iterable[float] | None = ..., row_centres_mm: Iterable[float] | None = ..., element_mm: Iterable[float] | None = ..., origin_mm: Iterable[float] | None = ..., rotation_deg: float | None = ..., rate_hz: float | None = ..., full_scale_counts: float | None = ..., baseline_counts: Iterable[float] | None = ..., covering_mm: float | None = ..., indenter: str | None = ..., indenter_shape: str | None = ..., indenter_width_mm: float | None = ..., x_mm: Iterable[float] | None = ..., y_mm: Iterable[float] | None = ..., z_max_mm: float | None = ..., depth_max_mm: float | None = ..., element_max_counts: float | None = ..., sum_max_counts: float | None = ..., baseline_band_counts: float | None = ..., safe_height_mm: float | None = ..., approach_height_mm: float | None = ..., unwatched_elements: Iterable[int] | None = ...) -> None: ...

class RunEvent(Message):
    seq: int
    run_id: str
    t_mono_ns: int
    t_wall_ns: int
    started: RunStarted
    step_started: StepStarted
    step_done: StepDone
    phase_changed: PhaseChanged
    dwell_done: DwellDone
    read_done: ReadDone
    tare_done: TareDone
    log: Log
    gap: Gap
    paused: Paused
    resumed: Resumed
    stop_requested: StopRequested
    press_repeated: PressRepeated
    covering_changed: CoveringChanged
    cleanup: Cleanup
    finished: RunFinished
    reference_done: ReferenceDone
    lease_taken: LeaseTaken
    def __init__(self, *, seq: int | None = ..., run_id: str | None = ..., t_mono_ns: int | None = ..., t_wall_ns: int | None = ..., started: RunStarted | None = ..., step_started: StepStarted | None = ..., step_done: StepDone | None = ..., phase_changed: PhaseChanged | None = ..., dwell_done: DwellDone | None = ..., read_done: ReadDone | None = ..., tare_done: TareDone | None = ..., log: Log | None = ..., gap: Gap | None = ..., paused: Paused | None = ..., resumed: Resumed | None = ..., stop_requested: StopRequested | None = ..., press_repeated: PressRepeated | None = ..., covering_changed: CoveringChanged | None = ..., cleanup: Cleanup | None = ..., finished: RunFinished | None = ..., reference_done: ReferenceDone | None = ..., lease_taken: LeaseTaken | None = ...) -> None: ...

class RunFinished(Message):
    exit_status: int
    message: str
    frames: int
    frames_lost: int
    presses: int
    dwells: int
    duration_s: float
    def __init__(self, *, exit_status: int | str | None = ..., message: str | None = ..., frames: int | None = ..., frames_lost: int | None = ..., presses: int | None = ..., dwells: int | None = ..., duration_s: float | None = ...) -> None: ...

class RunRequest(Message):
    experiment: str
    script: str
    parameters_json: str
    seed: int
    who: str
    lease: bytes
    continue_run: str
    def __init__(self, *, experiment: str | None = ..., script: str | None = ..., parameters_json: str | None = ..., seed: int | None = ..., who: str | None = ..., lease: bytes | None = ..., continue_run: str | None = ...) -> None: ...

class RunStarted(Message):
    experiment: str
    rig: str
    who: str
    simulated: bool
    seed: int
    script_sha256: str
    parameters_json: str
    covering_mm: float
    indenter: str
    presses_planned: int
    dwells_planned: int
    duration_planned_s: float
    versions: Mapping[str, str]
    taken_over: TakenOver
    def __init__(self, *, experiment: str | None = ..., rig: str | None = ..., who: str | None = ..., simulated: bool | None = ..., seed: int | None = ..., script_sha256: str | None = ..., parameters_json: str | None = ..., covering_mm: float | None = ..., indenter: str | None = ..., presses_planned: int | None = ..., dwells_planned: int | None = ..., duration_planned_s: float | None = ..., versions: Mapping[str, str] | None = ..., taken_over: TakenOver | None = ...) -> None: ...

class RunState(Message):
    run_id: str
    experiment: str
    phase: int
    presses: int
    presses_planned: int
    dwells: int
    dwells_planned: int
    frames: int
    frames_lost: int
    elapsed_s: float
    remaining_s: float
    message: str
    exit_status: int
    recording: str
    simulated: bool
    t_mono_ns: int
    fault: str
    taken_over: TakenOver
    def __init__(self, *, run_id: str | None = ..., experiment: str | None = ..., phase: int | str | None = ..., presses: int | None = ..., presses_planned: int | None = ..., dwells: int | None = ..., dwells_planned: int | None = ..., frames: int | None = ..., frames_lost: int | None = ..., elapsed_s: float | None = ..., remaining_s: float | None = ..., message: str | None = ..., exit_status: int | str | None = ..., recording: str | None = ..., simulated: bool | None = ..., t_mono_ns: int | None = ..., fault: str | None = ..., taken_over: TakenOver | None = ...) -> None: ...

class SafetyEvent(Message):
    seq: int
    t_mono_ns: int
    t_wall_ns: int
    verdict: int
    rule: str
    detail: str
    def __init__(self, *, seq: int | None = ..., t_mono_ns: int | None = ..., t_wall_ns: int | None = ..., verdict: int | str | None = ..., rule: str | None = ..., detail: str | None = ...) -> None: ...

class SensorInfo(Message):
    rig: str
    array: str
    rows: int
    cols: int
    rate_hz: float
    full_scale_counts: float
    tick_ns: int
    link: str
    transport: str
    simulated: bool
    def __init__(self, *, rig: str | None = ..., array: str | None = ..., rows: int | None = ..., cols: int | None = ..., rate_hz: float | None = ..., full_scale_counts: float | None = ..., tick_ns: int | None = ..., link: str | None = ..., transport: str | None = ..., simulated: bool | None = ...) -> None: ...

class StageState(Message):
    seq: int
    t_mono_ns: int
    t_wall_ns: int
    x_mm: float
    y_mm: float
    z_mm: float
    status: int
    alarm: int
    simulated: bool
    epoch: int
    def __init__(self, *, seq: int | None = ..., t_mono_ns: int | None = ..., t_wall_ns: int | None = ..., x_mm: float | None = ..., y_mm: float | None = ..., z_mm: float | None = ..., status: int | str | None = ..., alarm: int | None = ..., simulated: bool | None = ..., epoch: int | None = ...) -> None: ...

class StepDone(Message):
    step: int
    height_mm: float
    def __init__(self, *, step: int | None = ..., height_mm: float | None = ...) -> None: ...

class StepStarted(Message):
    step: int
    what: str
    at: str
    step_json: str
    def __init__(self, *, step: int | None = ..., what: str | None = ..., at: str | None = ..., step_json: str | None = ...) -> None: ...

class StopRequested(Message):
    by: str
    reason: str
    abort: bool
    def __init__(self, *, by: str | None = ..., reason: str | None = ..., abort: bool | None = ...) -> None: ...

class TakenOver(Message):
    run_id: str
    steps: int
    presses: int
    dwells: int
    first_press: int
    def __init__(self, *, run_id: str | None = ..., steps: int | None = ..., presses: int | None = ..., dwells: int | None = ..., first_press: int | None = ...) -> None: ...

class TareDone(Message):
    frames: int
    baseline_counts: Sequence[float]
    from_mono_ns: int
    to_mono_ns: int
    def __init__(self, *, frames: int | None = ..., baseline_counts: Iterable[float] | None = ..., from_mono_ns: int | None = ..., to_mono_ns: int | None = ...) -> None: ...
