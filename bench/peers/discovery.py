"""Other methods on the data of `tactus discover`: a black box and sparse regression on the residual, with time and memory.

`report` reads the tables that `tactus-bench evidence run --keep-tables` keeps: the measurements, and the residual of the
recalibrated base model, which all methods get. It writes reports in the form that the scorer reads. It opens no labels:
held-out presses decide, as in `tactus discover`.

- Black box: scikit-learn's gradient boosting of the residual on everything that is known of a reading. It names no
  effects: if it predicts held-out presses significantly, its verdict is `unexplained`. It is also fitted to the shallower
  presses only and judged on the deepest.
- Sparse regression: PySINDy's STLSQ on a library of generic terms of the signal and its derivatives and of the stage's
  motion. The threshold is the one that predicts held-out presses best. A term with at least a fifth of all weight names the
  effect whose first-order form it is; other effects of that form are its equivalents.
- Symbolic and sparse regression that draft what no effect explains: `drafts.py`.

`time` measures each of them, and a Gaussian process on 1,000 readings, on one table.
"""

import os

# One thread in every process. Must stand before numpy is loaded.
os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", MKL_NUM_THREADS="1")

import argparse
import json
import multiprocessing
import platform
import resource
import time
import warnings
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pysindy
import sklearn
from scipy.stats import ttest_1samp
from sklearn.ensemble import HistGradientBoostingRegressor
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, WhiteKernel

import drafts

LEVEL = 0.028
THRESHOLDS = (0.003, 0.01, 0.03, 0.1, 0.3)
HELD_OUT = 3
CARRIES = 0.2

# A term's effect, and the others whose first-order form is the same.
NAMES = {
    "t": ["baseline-drift"],
    "p t": ["gain-drift"],
    "p p": ["hardening", "saturation", "surface-offset"],
    "p p p": ["hardening", "saturation"],
    "p depth": ["hardening", "surface-offset", "depth-dependent-spread"],
    "dp/dt": ["time-lag", "low-pass", "scan-skew"],
    "d2p/dt2": ["low-pass", "time-lag"],
    "p speed": ["rate-stiffening"],
    "p sign": ["hysteresis", "backlash", "softening"],
    "p log held": ["relaxation"],
    "left": ["imprint", "baseline-drift"],
    "p past": ["softening", "hysteresis"],
    "beside": ["crosstalk", "heavy-tail"],
    "row": ["crosstalk"],
    "column": ["crosstalk"],
    "dp/dx": ["misregistration", "backlash", "indenter-tilt"],
    "dp/dy": ["misregistration", "backlash", "indenter-tilt"],
    "x dp/dx": ["misregistration"],
    "y dp/dy": ["misregistration"],
    "curved": ["heavy-tail", "depth-dependent-spread", "indenter-size"],
    "curved x - y": ["anisotropic-spread"],
    "p x": ["surface-tilt", "edge-effect"],
    "p y": ["surface-tilt", "edge-effect"],
    "p edge": ["edge-effect"],
}


def main():
    args = arguments()
    warnings.filterwarnings("ignore")
    if args.part == "time":
        print(json.dumps(timed(args.work, args.name), indent=1))
        return
    ids = sorted(str(path.relative_to(args.work / "residuals"))[:-8] for path in (args.work / "residuals").rglob("*.parquet"))
    with multiprocessing.Pool() as pool:
        for done, name in enumerate(pool.imap_unordered(partial(reported, args.work), ids), 1):
            print(f"{done}/{len(ids)} {name}", flush=True)


def reported(folder, name):
    """Writes the report of each method on a set, unless it is there already."""
    warnings.filterwarnings("ignore")
    data = None
    drafting = {"symbolic": drafts.symbolic, "sparse-drafts": drafts.sparse}
    drafting = {method: partial(drafted, draft) for method, draft in drafting.items()}
    for method, work in {"black-box": black_box, "sparse": sparse, **drafting}.items():
        ran = folder / "peers" / method / "ran" / f"{name}.json"
        if ran.exists():
            continue
        data = data or Data(folder, name)
        started, processor_s = time.perf_counter(), time.process_time()
        report = work(data)
        costs = {"seconds": time.perf_counter() - started, "processor_s": time.process_time() - processor_s}
        # Of this process until now: it has worked on other sets with other methods before.
        costs["peak_mib"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        write(folder / "peers" / method / "reports" / f"{name}.json", report)
        write(ran, {"program": method, **costs, "exit": 0, "said": ""})
    return name


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parts = parser.add_subparsers(dest="part", required=True)
    report = parts.add_parser("report")
    report.add_argument("--work", type=Path, required=True)
    of_time = parts.add_parser("time")
    of_time.add_argument("--work", type=Path, required=True)
    of_time.add_argument("--name", required=True)
    return parser.parse_args()


class Data:
    """The readings of a set: the base model's residual, and what is known of each reading."""

    def __init__(self, work, name):
        table, residuals = (pq.read_table(work / part / f"{name}.parquet") for part in ("sets", "residuals"))
        # All methods use the same noise, that of frames which repeat each other.
        self.noise = json.loads((work / "reports" / f"{name}.json").read_text())["noise_rms_counts"]
        rig = json.loads(table.schema.metadata[b"tactus.rig"])["array"]
        rows, cols = rig["rows"], rig["cols"]
        column = lambda name: table[name].to_numpy()
        counts = np.stack(table["counts"].to_numpy())
        before = [name for name in residuals.column_names if "before" in name][0]
        self.residual = np.stack(residuals[before].to_numpy()).astype(float)
        # What is known of a reading is the model's: a measured count holds the noise that its residual is made of.
        base = counts - self.residual
        self.press, self.t = column("press"), column("t_ns") * 1e-9
        self.base = base - np.median(base[self.press < 0], axis=0)
        x, y, z = (column(name) for name in ("x_mm", "y_mm", "z_mm"))
        self.velocity = np.stack([np.gradient(axis, self.t) for axis in (x, y, z)], axis=1)
        touched = self.base.max(axis=1) > 0.05 * self.base.max()
        self.depth = np.where(touched, np.quantile(z[touched], 0.98) - z, 0.0).clip(0)
        self.held, self.released = since(touched, self.t), since(~touched, self.t)
        self.past = np.maximum.accumulate(self.base, axis=0)
        self.at = np.stack([x - x.mean(), y - y.mean()], axis=1)
        self.z, self.counts, self.pitch = z, base, rig["col_centres_mm"][1] - rig["col_centres_mm"][0]
        self.height = np.where(touched, 0.0, z - np.quantile(z[touched], 0.98)).clip(0)
        known = "temperature_c" in table.column_names and column("temperature_c").astype(float)
        self.temperature = known if known is not False and np.isfinite(known).all() else None
        self.shape = (rows, cols)
        presses = np.unique(self.press[self.press >= 0])
        held = np.random.default_rng(1).permutation(presses)[: len(presses) // HELD_OUT]
        # Frames between the presses are fitted.
        self.is_held = np.isin(self.press, held)
        self.presses = len(presses)
        deepest = np.array([self.depth[self.press == press].max() for press in presses])
        deep = presses[deepest > np.quantile(deepest, 0.6)]
        self.is_deep = np.isin(self.press, deep)

    def features(self):
        """Inputs of the black box, for every reading."""
        n, elements = self.base.shape
        frame = np.stack(
            [self.depth, *self.velocity.T, self.held, self.released, self.t, *self.at.T, self.press], axis=1
        )[:, :-1]
        place = np.indices(self.shape).reshape(2, -1).T
        per_reading = [self.base, self.past, beside(self.base, self.shape)]
        wide = np.repeat(frame, elements, axis=0)
        return np.column_stack([wide, np.tile(place, (n, 1)), *(part.ravel() for part in per_reading)])

    def terms(self):
        """Terms of the sparse regression, for every reading: names, and values of unit root mean square."""
        p, (rows, cols) = self.base, self.shape
        image = p.reshape(-1, rows, cols)
        d = lambda axis: np.gradient(image, axis=axis).reshape(p.shape)
        dd = lambda axis: np.gradient(np.gradient(image, axis=axis), axis=axis).reshape(p.shape)
        rate = np.gradient(p, self.t, axis=0)
        wide = lambda of_frame: of_frame[:, None] * np.ones(p.shape[1])
        v = self.velocity[:, 2]
        row, column = np.indices(self.shape).reshape(2, -1)
        edge = np.exp(-np.minimum.reduce([row, rows - 1 - row, column, cols - 1 - column]).astype(float))
        falls = np.exp(-np.where(self.held > 0, np.inf, self.released) / 2.0)
        terms = {
            "t": wide(self.t / self.t.max()),
            "p t": p * wide(self.t / self.t.max()),
            "p p": p * p,
            "p p p": p * p * p,
            "p depth": p * wide(self.depth),
            "dp/dt": rate,
            "d2p/dt2": np.gradient(rate, self.t, axis=0),
            "p speed": p * wide(np.maximum(-v, 0)),
            "p sign": p * wide(np.sign(np.round(v, 3))),
            "p log held": p * wide(np.log1p(self.held / 0.3)),
            "left": self.past * wide(falls),
            "p past": p * self.past,
            "beside": beside(p, self.shape),
            "row": np.repeat(image.sum(axis=2, keepdims=True), cols, axis=2).reshape(p.shape),
            "column": np.repeat(image.sum(axis=1, keepdims=True), rows, axis=1).reshape(p.shape),
            "dp/dx": d(2),
            "dp/dy": d(1),
            "x dp/dx": d(2) * wide(self.at[:, 0]),
            "y dp/dy": d(1) * wide(self.at[:, 1]),
            "curved": dd(1) + dd(2),
            "curved x - y": dd(2) - dd(1),
            "p x": p * wide(self.at[:, 0]),
            "p y": p * wide(self.at[:, 1]),
            "p edge": p * edge,
        }
        # Gain and offset of each element are fitted already, so a term counts without them.
        for name, term in terms.items():
            term = term - term.mean(axis=0)
            own = p - p.mean(axis=0)
            term = term - own * ((term * own).sum(axis=0) / np.maximum((own * own).sum(axis=0), 1e-12))
            terms[name] = term / max(np.sqrt((term * term).mean()), 1e-12)
        return list(terms), np.stack([term.ravel() for term in terms.values()], axis=1)


def since(is_so, t):
    """Time in s for which a condition has held; 0 where it does not."""
    begins = np.flatnonzero(is_so & ~np.r_[False, is_so[:-1]])
    last = np.searchsorted(begins, np.arange(len(t)), side="right") - 1
    return np.where(is_so & (last >= 0), t - t[begins[np.maximum(last, 0)]] if len(begins) else 0.0, 0.0)


def beside(values, shape):
    """Sum over the four neighbours."""
    padded = np.pad(values.reshape(-1, *shape), ((0, 0), (1, 1), (1, 1)))
    around = padded[:, :-2, 1:-1] + padded[:, 2:, 1:-1] + padded[:, 1:-1, :-2] + padded[:, 1:-1, 2:]
    return around.reshape(values.shape)


def black_box(data):
    features = data.features()
    predicted = boosted(features, data.residual, ~data.is_held)
    deep = boosted(features, data.residual, ~data.is_deep)
    gains, shrink = gain(data, predicted, data.is_held)
    is_seen = ttest_1samp(gains, 0, alternative="greater").pvalue < LEVEL
    report = form(data, [], "unexplained" if is_seen else "nothing-missing", shrink)
    report["final"]["deeper_shrink"] = gain(data, deep, data.is_deep)[1]
    report["final"]["deeper_rms_counts"] = rms((data.residual - deep)[data.is_deep])
    report["base"]["deeper_rms_counts"] = rms(data.residual[data.is_deep])
    return report


def drafted(draft, data):
    """The report of a method that drafts: it names nothing, and says that something is missing if it has a draft."""
    found = draft(data)
    report = form(data, [], "unexplained" if found else "nothing-missing", None)
    return {**report, "draft": found}


def boosted(features, residual, rows):
    elements = residual.shape[1]
    readings = np.repeat(rows, elements)
    model = HistGradientBoostingRegressor(max_iter=100, random_state=1)
    return model.fit(features[readings], residual.ravel()[readings]).predict(features).reshape(residual.shape)


def sparse(data):
    names, terms = data.terms()
    predicted, weights = thresholded(data, terms, data.is_held)
    gains, shrink = gain(data, predicted, data.is_held)
    carried = np.abs(weights) / max(np.abs(weights).sum(), 1e-12)
    strong = [names[index] for index in np.argsort(-carried) if carried[index] >= CARRIES]
    is_seen = bool(weights.any()) and ttest_1samp(gains, 0, alternative="greater").pvalue < LEVEL
    steps, said = [], set()
    for name in strong if is_seen else []:
        effect, *others = NAMES[name]
        if effect not in said:
            steps.append({"effect": effect, "equivalent": others})
        said.add(effect)
    report = form(data, steps, "explained" if is_seen else "nothing-missing", shrink)
    deep, _ = thresholded(data, terms, data.is_deep)
    report["final"]["deeper_shrink"] = gain(data, deep, data.is_deep)[1]
    return report


def thresholded(data, terms, held):
    """The fit to the frames that are not held out, with the threshold that predicts the others best."""
    elements = data.residual.shape[1]
    readings = np.repeat(~held, elements)
    best = (np.zeros_like(data.residual), np.zeros(terms.shape[1]))
    least = np.mean(data.residual[held] ** 2)
    for threshold in THRESHOLDS:
        optimizer = pysindy.STLSQ(threshold=threshold * data.noise, alpha=1e-6)
        optimizer.fit(terms[readings], data.residual.ravel()[readings, None])
        weights = optimizer.coef_[0]
        predicted = (terms @ weights).reshape(data.residual.shape)
        error = np.mean((data.residual - predicted)[held] ** 2)
        if error < least:
            least, best = error, (predicted, weights)
    return best


def gain(data, predicted, held):
    """The gain of each held-out press, and the shrink over all of them."""
    before, after = data.residual**2, (data.residual - predicted) ** 2
    presses = np.unique(data.press[held])
    gains = [(before - after)[data.press == press].mean() for press in presses]
    gap = before[held].mean() - data.noise**2
    return gains, float((before - after)[held].mean() / gap) if gap > 0 else None


def form(data, steps, verdict, shrink):
    held = len(np.unique(data.press[data.is_held]))
    return {
        "split": {"frames": len(data.t), "train_presses": data.presses - held, "heldout_presses": held},
        "base": {"heldout_chi2": float(np.mean(data.residual[data.is_held] ** 2) / data.noise**2)},
        "rounds": [],
        "steps": steps,
        "final": {"shrink": shrink},
        "verdict": verdict,
    }


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


def timed(folder, name):
    rows = []

    def take(who, does, work):
        # Each method has its own process, so that the peak memory is its own.
        reader, writer = os.pipe()
        child = os.fork()
        if child == 0:
            data = Data(folder, name)
            started = time.perf_counter()
            work(data)
            os.write(writer, json.dumps(time.perf_counter() - started).encode())
            os._exit(0)
        _, status, usage = os.wait4(child, 0)
        os.close(writer)
        seconds = json.loads(os.read(reader, 100) or "null")
        rows.append({"who": who, "does": does, "seconds": seconds, "peak_mib": usage.ru_maxrss / 1024})

    def gaussian_process(data):
        features, residual = data.features(), data.residual.ravel()
        scaled = (features - features.mean(axis=0)) / np.maximum(features.std(axis=0), 1e-12)
        some = np.random.default_rng(1).choice(len(residual), 1000, replace=False)
        process = GaussianProcessRegressor(RBF(np.ones(scaled.shape[1])) + WhiteKernel(), random_state=1)
        process.fit(scaled[some], residual[some])
        for part in np.array_split(scaled, max(len(scaled) // 20_000, 1)):
            process.predict(part)

    take("PySINDy STLSQ", "24 generic terms, five thresholds, on all readings; no effect names", sparse)
    take("scikit-learn gradient boosting", "100 trees on all readings, twice; no effect names", black_box)
    take("scikit-learn Gaussian process", "fitted to 1,000 of the readings, predicts all; no effect names", gaussian_process)
    versions = {"python": platform.python_version(), "numpy": np.__version__, "scikit-learn": sklearn.__version__, "pysindy": pysindy.__version__}
    return {"versions": versions, "frames": len(Data(folder, name).t), "rows": rows}


def write(path, value):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(value, indent=1))


if __name__ == "__main__":
    main()
