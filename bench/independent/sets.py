"""The 42 sets: which physics is hidden in each, in which form, and how its parameters are drawn.

26 sets hide one effect of the library each, six hide two, six hide physics outside the library, and four hide nothing.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import covering
import electronics
import motion
import outside
import spread
from draws import Aliased, Near, Phase, Seed, TwoPairs, either_way
from physics import Both, Hidden


@dataclass
class Spec:
    """What is hidden in a set. The label is `none` where nothing is, and `outside` where no effect of the library describes it.

    `parameters` says how those of `hidden` are drawn, `options` are the rig's.
    """

    labels: list
    form: str
    hidden: Callable = Hidden
    parameters: dict = field(default_factory=dict)
    options: dict = field(default_factory=dict)


def drawn(spec, rng):
    """Parameters of a set."""
    return {name: how.draw(rng) for name, how in spec.parameters.items()}


def miswired(pairs, share):
    return electronics.Wires(swapped=tuple(pairs[0]), bridged=tuple(pairs[1]), share=share)


def relaxing_and_shifted(share, time_s, x_mm, y_mm, turn_deg):
    return Both(covering.StandardLinearSolid(share, time_s), motion.Misregistration(x_mm, y_mm, turn_deg))


def drifting_and_saturated(rms_counts, seed, top_counts):
    return Both(electronics.Flicker(rms_counts, seed), electronics.ArctanSaturation(top_counts))


def hysteretic_and_coupled(share, most_mm, memory):
    return Both(covering.BoucWen(share, most_mm), electronics.MultiplexerMemory(memory))


def slow_and_tilted(first_s, second_s, slope_x, slope_y):
    return Both(motion.SurfaceTilt(slope_x, slope_y), electronics.TwoPoles(first_s, second_s))


def discharged_and_heavy(loss, knee, shape):
    return Both(electronics.Discharge(loss, knee), spread.VarianceGamma(shape))


def miswired_and_stiff(pairs, bridge_share, share, speed_mm_per_s, time_s):
    wires = electronics.Wires(dead=(pairs[0][0],), bridged=tuple(pairs[1]), share=bridge_share)
    return Both(wires, covering.Eyring(share, speed_mm_per_s, time_s))


SPECS = [
    Spec(
        ["anisotropic-spread"],
        "shear lag along fibres: exponential beside the Gaussian",
        spread.Fibres,
        {"share": Near(0.6), "length_mm": Near(2.2), "angle_deg": either_way(12)},
    ),
    Spec(
        ["backlash"],
        "Dahl friction in each axis",
        motion.Dahl,
        {"x_mm": Near(0.16), "y_mm": Near(0.13), "z_mm": Near(0.012), "reach_mm": Near(0.04)},
    ),
    Spec(
        ["baseline-drift"],
        "warm-up and a cycle of the room; coefficients of the elements differ by 5 %",
        electronics.WarmUp,
        {
            "warm_up_counts": either_way(28),
            "time_s": Near(220),
            "cycle_counts": either_way(6),
            "period_s": Near(410),
            "seed": Seed(),
        },
    ),
    Spec(
        ["crosstalk"],
        "RC ladder along the row, in counts",
        electronics.RowLadder,
        {"share": Near(0.06), "reach_columns": Near(1.8)},
    ),
    Spec(["depth-dependent-spread"], "Hertz: variance grows with depth", spread.HertzSpread, {"growth_mm": Near(3.0)}),
    Spec(
        ["edge-effect"],
        "free ends of a beam on an elastic foundation",
        covering.FreeEdge,
        {"share": Near(0.38), "length_mm": Near(1.9)},
    ),
    Spec(
        ["gain-drift"],
        "settling reference and a cycle of the room",
        electronics.ReferenceAging,
        {"settling": either_way(-0.13), "time_s": Near(260), "cycle": either_way(0.015), "period_s": Near(500)},
    ),
    Spec(["hardening"], "Ogden, uniaxial, by the tool's depth", covering.Ogden, {"exponent": Near(3.0), "share": Near(0.45)}),
    Spec(["heavy-tail"], "Boussinesq beside the Gaussian", spread.Boussinesq, {"share": Near(0.4), "below_mm": Near(2.6)}),
    Spec(
        ["hysteresis"],
        "Maxwell-slip (Iwan) on the tool's depth",
        covering.MaxwellSlip,
        {"total_mm": Near(0.035), "spread": Near(0.8)},
    ),
    Spec(
        ["imprint"],
        "the deepest dent so far, recovering as a stretched exponential",
        covering.Dent,
        {"share": Near(0.14), "time_s": Near(12), "exponent": Near(0.5)},
    ),
    Spec(
        ["indenter-size"],
        "wider cylinder with a fillet of its rim",
        spread.FilletedTool,
        {"ratio": Near(1.4, above=1.0), "fillet_mm": Near(0.9)},
        {"tool_mm": 6.0},
    ),
    Spec(
        ["indenter-tilt"],
        "cylinder on a joint that aligns itself with depth",
        spread.TiltedTool,
        {"tilt_deg": Near(3.5), "azimuth_deg": either_way(35), "aligning_mm": Near(1.2)},
        {"tool_mm": 4.0},
    ),
    Spec(["low-pass"], "second order", electronics.SecondOrder, {"corner_hz": Near(1.6), "damping": Near(0.75)}),
    Spec(
        ["misregistration"],
        "shift, turn, scale and the error of a lead screw",
        motion.Misregistration,
        {
            "x_mm": either_way(0.28),
            "y_mm": either_way(-0.2),
            "turn_deg": either_way(0.9),
            "scale": either_way(0.006),
            "lead_error_mm": either_way(0.02),
        },
    ),
    Spec(["miswired"], "two elements swapped, one bridged to the next", miswired, {"pairs": TwoPairs(), "share": Near(0.6)}),
    Spec(
        ["periodic-interference"],
        "two terms of a square wave beyond the frame rate, shifted from column to column",
        electronics.Switcher,
        {
            "amplitude_counts": Near(11),
            "frequency_hz": Aliased(61.7),
            "column_deg": either_way(17),
            "phase": Phase(),
        },
    ),
    Spec(["quantisation"], "truncation to whole steps", electronics.Truncation, {"step_counts": Near(22, is_whole=True)}),
    Spec(
        ["rate-stiffening"],
        "Cowper-Symonds while loading, dying away in a hold",
        covering.CowperSymonds,
        {"share": Near(0.14), "exponent": Near(2.2), "time_s": Near(1.2)},
    ),
    Spec(
        ["relaxation"],
        "power law, superposition after Boltzmann",
        covering.PowerLaw,
        {"exponent": Near(0.11), "after_s": Near(0.15)},
    ),
    Spec(["saturation"], "hyperbolic tangent", electronics.TanhSaturation, {"top_counts": Near(560)}),
    Spec(
        ["scan-skew"],
        "column by column, rows quickly one after another",
        electronics.ColumnScan,
        {"column_s": Near(0.0042), "row_s": Near(0.0002)},
        {"noise": ("white", 1.0)},
    ),
    Spec(["softening"], "damage by the work of loading", covering.Damage, {"most": Near(0.28), "work_mm2": Near(0.5)}),
    Spec(
        ["surface-offset"],
        "surface at another height, with asperities",
        motion.SurfaceOffset,
        {"offset_mm": either_way(0.055), "roughness_mm": Near(0.008)},
    ),
    Spec(
        ["surface-tilt"],
        "plane with a small bow",
        motion.SurfaceTilt,
        {"slope_x": either_way(0.0065), "slope_y": either_way(-0.0045), "bow_per_mm": either_way(0.00012)},
    ),
    Spec(
        ["time-lag"], "late frames and a clock of another rate", electronics.ClockError, {"lag_s": Near(0.085), "skew": either_way(1.5e-5)}
    ),
    Spec(["none"], "white noise", options={"noise": ("white", 1.0)}),
    Spec(["none"], "white noise", options={"noise": ("white", 2.0), "thickness_mm": 2.54}),
    Spec(["none"], "noise with a memory", options={"noise": ("ar1", 1.5)}),
    Spec(["none"], "rounding only", options={"noise": ("quantised", 0.0)}),
    Spec(
        ["relaxation", "misregistration"],
        "standard linear solid; shift and turn",
        relaxing_and_shifted,
        {
            "share": Near(0.22),
            "time_s": Near(1.6),
            "x_mm": either_way(-0.22),
            "y_mm": either_way(0.24),
            "turn_deg": either_way(-0.7),
        },
    ),
    Spec(
        ["baseline-drift", "saturation"],
        "three processes of Ornstein and Uhlenbeck, common; arcus tangent",
        drifting_and_saturated,
        {"rms_counts": Near(10), "seed": Seed(), "top_counts": Near(1100)},
    ),
    Spec(
        ["hysteresis", "crosstalk"],
        "Bouc-Wen on the tool's depth; a multiplexer's memory in the order of the scan",
        hysteretic_and_coupled,
        {"share": Near(0.14), "most_mm": Near(0.09), "memory": Near(0.07)},
    ),
    Spec(
        ["low-pass", "surface-tilt"],
        "two RC stages; plane",
        slow_and_tilted,
        {"first_s": Near(0.07), "second_s": Near(0.03), "slope_x": either_way(-0.005), "slope_y": either_way(0.007)},
    ),
    Spec(
        ["gain-drift", "heavy-tail"],
        "discharge of a cell; variance-gamma spread",
        discharged_and_heavy,
        {"loss": Near(0.14), "knee": Near(4.0), "shape": Near(6.0)},
    ),
    Spec(
        ["miswired", "rate-stiffening"],
        "a dead element and a bridged one; Eyring flow",
        miswired_and_stiff,
        {
            "pairs": TwoPairs(),
            "bridge_share": Near(0.75),
            "share": Near(0.05),
            "speed_mm_per_s": Near(0.15),
            "time_s": Near(0.8),
        },
    ),
    Spec(["outside"], "supply drops out above a total load", outside.Droop, {"load_counts": Near(2000), "slope": Near(0.16)}),
    Spec(["outside"], "an air gap under each element closes", outside.ClosingGap, {"gap_mm": Near(0.045), "seed": Seed()}),
    Spec(
        ["outside"],
        "gain follows a hum with a beat",
        outside.GainHum,
        {"share": Near(0.06), "frequency_hz": Near(1.37), "beat_s": Near(47)},
    ),
    Spec(
        ["outside"],
        "contact electrification, also seen in later presses",
        outside.ContactCharge,
        {"charge_counts": Near(45), "time_s": Near(9), "width_mm": Near(3.5)},
    ),
    Spec(
        ["outside"],
        "grounded tool in the fringing field before contact",
        outside.Proximity,
        {"most_counts": Near(60), "reach_mm": Near(0.5), "width_mm": Near(3.0)},
    ),
    Spec(["outside"], "adhesion to the leaving tool", outside.Adhesion, {"reach_mm": Near(0.15), "share": Near(0.7)}),
]
