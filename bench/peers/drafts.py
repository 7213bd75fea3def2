"""Symbolic and sparse regression of what no effect explains, with the covariates that Tactus' drafts may have.

Both get the residual of the recalibrated base model and what is known of each frame and reading, under the names of Tactus'
covariates. A draft of theirs is where it acts and on what it depends most, found as a reader of their output would:

- Symbolic regression: Operon (pyoperon), genetic programming of expressions. PySR, which searches in the same way, needs a
  Julia that no package index holds. Three targets: the mean residual of a frame (counts are added), its residual as a share
  of the signal (the signal changes), and the residual of single readings. The covariate is the input whose values matter most
  to the best expression when they are shuffled.
- Sparse regression: PySINDy's STLSQ on 1 and the own signal, times each covariate and its square. The covariate is
  that of the term which explains most.

Held-out presses choose between targets and between thresholds. There is a draft if it predicts them significantly. What it closes
is measured as Tactus measures it: the noise cancels in what is closed, and what is left is what lasts from frame to frame.
"""

import numpy as np
import pysindy
from pyoperon.sklearn import SymbolicRegressor
from scipy.stats import ttest_1samp

LEVEL = 0.005
THRESHOLDS = (0.003, 0.01, 0.03, 0.1, 0.3)
READINGS = 20_000
SINGLE = 4_000
LAG = 8
LOUD = 0.05

SEARCH = dict(population_size=300, generations=40, max_evaluations=150_000, max_length=25, n_threads=1, random_state=1)
SYMBOLS = "add,sub,mul,div,exp,log,sin,sqrt,square,constant,variable"


def symbolic(data):
    """The draft of symbolic regression; None if none predicts held-out presses."""
    frames, readings = of_frames(data), of_readings(data)
    own, elements = data.base, data.base.shape[1]
    power = (own * own).sum(axis=1)
    touches = own.max(axis=1) > LOUD * own.max()
    share = np.where(touches, (data.residual * own).sum(axis=1) / np.maximum(power, 1e-12), 0.0)
    every = np.ones(len(own), bool)
    tries = [
        ("readout", frames, data.residual.mean(axis=1), every, lambda values: np.repeat(values[:, None], elements, axis=1)),
        ("covering", frames, share, touches, lambda values: own * np.where(touches, values, 0.0)[:, None]),
    ]
    drafts = [regressed(data, *one) for one in tries] + [of_single(data, readings)]
    return best(drafts)


def sparse(data):
    """The draft of sparse regression; None if none predicts held-out presses."""
    own, elements = data.base, data.base.shape[1]
    fitted = np.flatnonzero(np.repeat(~data.is_held, elements))
    some = np.random.default_rng(1).choice(fitted, min(READINGS, len(fitted)), replace=False)
    held = np.flatnonzero(np.repeat(data.is_held, elements))
    keys, columns = [], []
    for name, values in {**of_frames(data), **of_readings(data)}.items():
        values = np.broadcast_to(values[:, None] if values.ndim == 1 else values, own.shape)
        values = (values - values.mean()) / max(values.std(), 1e-12)
        for stage, carrier in (("readout", 1.0), ("covering", own)):
            for power in (1, 2):
                term = (carrier * values**power).ravel()
                keys.append((stage, name))
                columns.append(np.r_[term[some], term[held]] / max(term.std(), 1e-12))
    terms = np.stack(columns, axis=1)
    at_some, at_held = terms[: len(some)], terms[len(some) :]
    target = data.residual.ravel()[some]
    drafts = []
    for threshold in THRESHOLDS:
        optimizer = pysindy.STLSQ(threshold=threshold * data.noise, alpha=1e-6)
        optimizer.fit(at_some, target[:, None])
        weights = optimizer.coef_[0]
        if not weights.any():
            continue
        stage, covariate = keys[int(np.argmax(np.abs(weights)))]
        predicted = np.zeros_like(data.residual)
        predicted[data.is_held] = (at_held @ weights).reshape(-1, elements)
        drafts.append((gains(data, predicted), stage, covariate, predicted))
    return told(data, drafts)


def regressed(data, stage, inputs, target, rows, spread):
    names, values = list(inputs), np.stack(list(inputs.values()), axis=1)
    fitted = rows & ~data.is_held
    model = SymbolicRegressor(allowed_symbols=SYMBOLS, **SEARCH)
    model.fit(values[fitted], target[fitted])
    predicted = spread(finite(model.predict(values)))
    most = important(model, values[fitted], target[fitted])
    return gains(data, predicted), stage, names[most], predicted, data


def of_single(data, readings):
    """A regression of single readings, with those of the loud ones and the own signal as inputs."""
    names = list(readings)
    shape = data.base.shape
    values = np.stack([readings[name].ravel() for name in names], axis=1)
    fitted = np.flatnonzero(np.repeat(~data.is_held, shape[1]))
    some = np.random.default_rng(1).choice(fitted, min(SINGLE, len(fitted)), replace=False)
    model = SymbolicRegressor(allowed_symbols=SYMBOLS, **SEARCH)
    target = data.residual.ravel()
    model.fit(values[some], target[some])
    predicted = finite(model.predict(values)).reshape(shape)
    most = names[important(model, values[some], target[some])]
    return gains(data, predicted), "readout" if most == "counts" else "covering", most, predicted, data


def important(model, values, target):
    """The input without whose values the prediction is worst."""
    rng = np.random.default_rng(1)
    losses = []
    for column in range(values.shape[1]):
        shuffled = values.copy()
        shuffled[:, column] = rng.permutation(shuffled[:, column])
        losses.append(np.mean((target - finite(model.predict(shuffled))) ** 2))
    return int(np.argmax(losses))


def best(drafts):
    return told(drafts[0][-1], [draft[:-1] for draft in drafts])


def told(data, drafts):
    """The draft that gains most on held-out presses, as a report has it; None if its gain is not significant."""
    drafts = [draft for draft in drafts if np.isfinite(draft[3]).all()]
    if not drafts:
        return None
    gain, stage, covariate, predicted = max(drafts, key=lambda draft: np.sum(draft[0]))
    # As one of several was chosen.
    if not ttest_1samp(gain, 0, alternative="greater").pvalue < LEVEL / len(drafts):
        return None
    return {"stage": stage, "covariates": [{"covariate": covariate}], "closed_share": closed(data, predicted)}


def gains(data, predicted):
    """The gain of each held-out press."""
    change = (data.residual**2 - (data.residual - predicted) ** 2).mean(axis=1)
    return [change[data.press == press].mean() for press in np.unique(data.press[data.is_held])]


def closed(data, predicted):
    before, after = data.residual[data.is_held], (data.residual - predicted)[data.is_held]
    explained = float(np.mean(before**2 - after**2))
    same = data.press[data.is_held][:-LAG] == data.press[data.is_held][LAG:]
    left = max(0.0, float(np.mean((after[:-LAG] * after[LAG:])[same])))
    return explained / (explained + left) if explained + left > 0 else None


def of_frames(data):
    """What is known of each frame."""
    (x, y), depth = data.at.T, data.depth
    speed = data.velocity[:, 2]
    turns = np.abs(np.diff(np.sign(np.round(speed, 2)), prepend=0)) > 0
    turned = np.maximum.accumulate(np.where(turns, data.t, data.t[0]))
    inside = lambda at: at - np.round(at / data.pitch) * data.pitch
    frames = {
        "time": data.t,
        "time since contact": data.held,
        "time since release": data.released,
        "time since a start or stop": data.t - turned,
        "depth": depth,
        "largest past depth": np.maximum.accumulate(depth),
        "height above the surface": data.height,
        "direction of motion": np.sign(np.round(speed, 2)),
        "speed": speed,
        "speed of travel": np.linalg.norm(data.velocity, axis=1),
        "travel": np.cumsum(np.abs(np.diff(data.z, prepend=data.z[0]))),
        "place along x": x,
        "place along y": y,
        "place in the element along x": inside(x),
        "place in the element along y": inside(y),
        "sum of signals": data.base.sum(axis=1),
    }
    if data.temperature is not None:
        frames["temperature"] = data.temperature
    return frames


def of_readings(data):
    """What is known of each reading."""
    rows, cols = data.shape
    row, column = np.indices((rows, cols)).reshape(2, -1)
    centre = lambda index, count: (index - (count - 1) / 2) * data.pitch
    away_x = centre(column, cols)[None, :] - data.at[:, :1]
    away_y = centre(row, rows)[None, :] - data.at[:, 1:]
    moved = np.cumsum(np.linalg.norm(data.velocity[:, :2], axis=1) > 0.1)
    last = np.maximum.accumulate(np.where(np.diff(moved, prepend=0) > 0, np.arange(len(moved)), 0))
    heading = data.velocity[last, :2]
    heading = heading / np.maximum(np.linalg.norm(heading, axis=1, keepdims=True), 1e-9)
    largest = np.maximum(data.base.max(axis=1, keepdims=True), 1e-9)
    return {
        "signal": data.base,
        "counts": data.counts,
        "share of the largest signal": np.where(largest > LOUD * data.base.max(), data.base / largest, 0.0),
        "distance from the tip": np.hypot(away_x, away_y),
        "distance along the approach": away_x * heading[:, :1] + away_y * heading[:, 1:],
        "depth": np.repeat(data.depth[:, None], data.base.shape[1], axis=1),
    }


def finite(values):
    return np.nan_to_num(np.asarray(values, float).ravel(), nan=0.0, posinf=0.0, neginf=0.0)
