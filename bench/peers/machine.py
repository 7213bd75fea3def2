"""What a figure was measured on."""

import datetime
import importlib.metadata
import math
import os
import platform


def machine():
    """The day, the processor and its cores."""
    with open("/proc/cpuinfo") as cpuinfo:
        models = [line.split(":")[1].strip() for line in cpuinfo if line.startswith("model name")]
    model = models[0] if models else platform.machine()
    return f"{datetime.date.today()}, {model}, {os.cpu_count()} cores, {platform.system()}"


def versions(*packages):
    """Of Python and of installed packages."""
    return {"python": platform.python_version(), **{package: importlib.metadata.version(package) for package in packages}}


def described(versions):
    """Both in a line."""
    return f"{machine()}; " + ", ".join(f"{who} {version}" for who, version in versions.items())


def exponent(points):
    """`p`, where the second of each pair grows as `first^p`: the least-squares slope of the logarithms."""
    logs = [(math.log(size), math.log(cost)) for size, cost in points]
    mean_size, mean_cost = (sum(axis) / len(logs) for axis in zip(*logs))
    along = sum((size - mean_size) * (cost - mean_cost) for size, cost in logs)
    return along / sum((size - mean_size) ** 2 for size, _ in logs)
