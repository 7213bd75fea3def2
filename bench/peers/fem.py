"""The finite element model of the covering: reactions and times of Tactus beside those of CalculiX and scikit-fem.

All programs solve the same slabs of cubes: bottom bonded, sides on rollers, 1 N on the middle of the top. With mean
dilatation Tactus equals scikit-fem, whose pressure is constant in a brick, which is the same. With full integration it
equals CalculiX, whose C3D8 bricks are integrated in full in linear statics. Free sides show whether the sides matter.
"""

import os

# One thread for all, but for CalculiX's solver, which may have every core.
CORES = str(os.cpu_count())
os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", MKL_NUM_THREADS="1")

import argparse
import json
import shutil
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
import skfem
from scipy.sparse.linalg import LinearOperator, cg, spsolve
from skfem.helpers import ddot, div, sym_grad, trace

import machine

REPOSITORY = Path(__file__).parents[2]
# Unknowns up to which scikit-fem's equations are factorised; beyond, fill is out of hand and gradients are conjugate.
DIRECT = 30_000


def main():
    args = arguments()
    results = [result for mesh in args.meshes for nu in args.poisson_ratios for result in compare(args, mesh, nu)]
    if args.json:
        print(json.dumps({"machine": machine.machine(), "versions": versions(), "results": results}, indent=1))
    else:
        print_table(results)
    if args.within is not None:
        worst = max(result["off"] for result in results if result["sides"] == "rollers")
        if not worst <= args.within:
            raise SystemExit(f"reactions differ by {worst:.1e} of the peak, more than {args.within:.0e}")


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--binary", type=Path, default=REPOSITORY / "target/dist/tactus-bench")
    meshes = [(20, 5), (40, 10), (64, 10), (100, 10)]
    parser.add_argument("--meshes", nargs="+", type=mesh, default=meshes, help="ACROSSxLAYERS")
    parser.add_argument("--poisson-ratios", nargs="+", type=float, default=[0.45])
    parser.add_argument("--peers", nargs="+", choices=PEERS, default=list(PEERS))
    parser.add_argument("--sides", nargs="+", choices=("rollers", "free"), default=["rollers", "free"])
    parser.add_argument("--rounds", type=int, default=5, help="the median of so many; one of what takes over 20 s")
    parser.add_argument("--within", type=float, help="fail if reactions differ by more, as a share of the peak")
    parser.add_argument("--json", action="store_true")
    return parser.parse_args()


def mesh(text):
    across, layers = map(int, text.split("x"))
    return across, layers


def compare(args, mesh, nu):
    """Every peer, timed, and its difference from us who integrate as it does."""
    for name in args.peers:
        solve, full = PEERS[name]
        ours = ask(args.binary, mesh, nu, full)
        forces = np.array(ours["forces"])
        for sides in args.sides:
            found, times = solve(mesh, nu, sides)
            while sides == "rollers" and len(times) < args.rounds and times[0] < 20:
                times += solve(mesh, nu, sides)[1]
            yield {
                "mesh": f"{mesh[0]} x {mesh[0]} x {mesh[1]}",
                "bricks": mesh[0] ** 2 * mesh[1],
                "nu": nu,
                "who": name,
                "sides": sides,
                "time_s": statistics.median(times),
                "rounds": len(times),
                "ours_s": ours["solve_s"],
                "peak": forces.max(),
                "off": abs(found - forces).max() / forces.max(),
            }


def ask(binary, mesh, nu, full):
    options = ["--across", mesh[0], "--layers", mesh[1], "--poisson-ratio", nu] + ["--full"] * full
    said = subprocess.run([binary, "fem", "--json", *map(str, options)], capture_output=True, check=True, text=True)
    return json.loads(said.stdout)


def calculix(mesh, nu, sides):
    """Wall time of `ccx` from deck to printed reactions; the deck is written before."""
    program = shutil.which("ccx")
    if program is None:
        raise SystemExit("there is no ccx: apt-get install calculix-ccx")
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "slab.inp").write_text(deck(mesh, nu, sides))
        started = time.perf_counter()
        environment = os.environ | {"OMP_NUM_THREADS": CORES}
        subprocess.run([program, "slab"], cwd=folder, env=environment, capture_output=True, check=True)
        took = time.perf_counter() - started
        rows = (line.split() for line in Path(folder, "slab.dat").read_text().splitlines())
        return np.array([float(row[3]) for row in rows if len(row) == 4 and row[0].isdigit()]), [took]


def deck(mesh, nu, sides):
    across, layers = mesh
    ends, inner, heights = (0, across), range(across + 1), range(1, layers + 1)
    node = lambda x, y, z: 1 + x + (across + 1) * (y + (across + 1) * z)
    corners = [(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{node(x, y, z)},{x},{y},{z}" for z in range(layers + 1) for y in inner for x in inner]
    lines += ["*ELEMENT, TYPE=C3D8, ELSET=BRICKS"]
    bricks = ((x, y, z) for z in range(layers) for y in range(across) for x in range(across))
    for number, (x, y, z) in enumerate(bricks, 1):
        lines.append(",".join(map(str, [number] + [node(x + dx, y + dy, z + dz) for dx, dy, dz in corners])))
    lines += ["*NSET, NSET=BOTTOM"] + [str(node(x, y, 0)) for y in inner for x in inner]
    lines += ["*NSET, NSET=X"] + [str(node(x, y, z)) for z in heights for y in inner for x in ends]
    lines += ["*NSET, NSET=Y"] + [str(node(x, y, z)) for z in heights for y in ends for x in inner]
    lines += ["*MATERIAL, NAME=RUBBER", "*ELASTIC", f"1.,{nu}", "*SOLID SECTION, ELSET=BRICKS, MATERIAL=RUBBER"]
    lines += ["*BOUNDARY", "BOTTOM,1,3"] + ["X,1,1", "Y,2,2"] * (sides == "rollers")
    lines += ["*STEP", "*STATIC, SOLVER=SPOOLES", "*CLOAD", f"{node(across // 2, across // 2, layers)},3,-1."]
    lines += ["*NODE PRINT, NSET=BOTTOM", "RF", "*END STEP", ""]
    return "\n".join(lines)


def scikit_fem(mesh, nu, sides):
    """Time to assemble and solve; displacements trilinear, pressure constant in a brick and eliminated."""
    across, layers = mesh
    started = time.perf_counter()
    edge = np.arange(across + 1.0)
    slab = skfem.MeshHex.init_tensor(edge, edge, np.arange(layers + 1.0))
    basis = skfem.Basis(slab, skfem.ElementVector(skfem.ElementHex1()), intorder=3)
    swell = swelling.assemble(basis, basis.with_element(skfem.ElementHex0()))
    # Bricks have a volume of 1, so the mass of a constant pressure is 1.
    stiffness = (shear.assemble(basis) + 2 * (1 + nu) / (3 * (1 - 2 * nu)) * swell.T @ swell).tocsr()
    (x, y, z), unknowns = slab.p, basis.nodal_dofs
    held = [unknowns[:, z == 0].ravel()]
    if sides == "rollers":
        held += [unknowns[0, (x == 0) | (x == across)], unknowns[1, (y == 0) | (y == across)]]
    free = np.setdiff1d(np.arange(basis.N), np.concatenate(held))
    load = np.zeros(basis.N)
    load[unknowns[2, (x == across / 2) & (y == across / 2) & (z == layers)]] = -1
    moved = np.zeros(basis.N)
    moved[free] = solved(stiffness[free][:, free], load[free])
    bottom = np.flatnonzero(z == 0)
    bottom = bottom[np.lexsort((x[bottom], y[bottom]))]
    return (stiffness @ moved)[unknowns[2, bottom]], [time.perf_counter() - started]


@skfem.BilinearForm
def shear(u, v, _):
    strain, test = sym_grad(u), sym_grad(v)
    return 2 * (ddot(strain, test) - trace(strain) * trace(test) / 3)


@skfem.BilinearForm
def swelling(u, pressure, _):
    return div(u) * pressure


def solved(stiffness, load):
    if len(load) <= DIRECT:
        return spsolve(stiffness, load)
    diagonal = stiffness.diagonal()
    scaled = LinearOperator(stiffness.shape, lambda rest: rest.ravel() / diagonal)
    moved, failed = cg(stiffness, load, rtol=1e-10, maxiter=10_000, M=scaled)
    assert not failed, "conjugate gradients did not converge"
    return moved


# How each solves, and whether it integrates in full.
PEERS = {"CalculiX": (calculix, True), "scikit-fem": (scikit_fem, False)}


def versions():
    said = machine.versions("scikit-fem", "numpy", "scipy")
    if shutil.which("ccx"):
        ccx = subprocess.run(["ccx", "-v"], capture_output=True, text=True)
        said["CalculiX"] = ccx.stdout.split()[-1]
    return said


def print_table(results):
    print(machine.described(versions()))
    print(
        f"{'bricks':<16}{'nu':>6}  {'who':<12}{'sides':<9}{'time, s':>10}{'of':>4}{'tactus, ms':>12}{'to tactus':>12}"
        f"{'peak, N':>10}{'difference':>12}"
    )
    for result in results:
        print(
            f"{result['mesh']:<16}{result['nu']:>6}  {result['who']:<12}{result['sides']:<9}{result['time_s']:>10.3f}"
            f"{result['rounds']:>4}{1e3 * result['ours_s']:>12.3f}{result['time_s'] / result['ours_s']:>12,.0f}"
            f"{result['peak']:>10.5f}{result['off']:>12.1e}"
        )
    for who in dict.fromkeys(result["who"] for result in results):
        solved = [result for result in results if result["who"] == who and result["sides"] == "rollers"]
        if len({result["bricks"] for result in solved}) > 1:
            for name, key in ((who, "time_s"), (f"tactus, as {who} integrates", "ours_s")):
                points = np.log([(result["bricks"], result[key]) for result in solved])
                print(f"{name}: time ~ bricks^{np.polyfit(*points.T, 1)[0]:.2f}")


if __name__ == "__main__":
    main()
