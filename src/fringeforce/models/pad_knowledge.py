"""What is known together of all that lasts about a pad, such as by a calibration."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.base.storage import read

if TYPE_CHECKING:
    import h5py

SAME_TOLERANCE = 1e-6
"""Relative change of a tolerance that rounding in a design file may cause."""


@dataclass(frozen=True, eq=False)
class PadKnowledge:
    """Mean and covariance of the unknowns of tolerances that stay as they are.

    Attributes
    ----------
    stds : mapping
        Tolerance of every path, in the unit of the value: what its unknowns are measured in.
    counts : mapping
        Number of unknowns of every path; they stand one after the other.
    mean : ndarray, shape (S,)
        Expected values of the unknowns.
    covariance : ndarray, shape (S, S)
        Their covariance.
    """

    stds: Mapping[str, float]
    counts: Mapping[str, int]
    mean: Array
    covariance: Array

    def expected(self, groups: Mapping[str, tuple[slice, float]], size: int) -> tuple[Array, Array]:
        """Mean, shape (size,), and precision, (size, size), of the unknowns of a design.

        What the design states anew since then takes the place of what is known of it.

        Parameters
        ----------
        groups : mapping
            Where the unknowns of every path stand, and its tolerance.
        size : int
            Number of unknowns.
        """
        mean, covariance = np.zeros(size), np.eye(size)
        ours, theirs, begin = [], [], 0
        for path, count in self.counts.items():
            there = groups.get(path)
            if (
                there is not None
                and there[0].stop - there[0].start == count
                and abs(there[1] / self.stds[path] - 1) < SAME_TOLERANCE
            ):
                ours.append(np.arange(begin, begin + count))
                theirs.append(np.arange(there[0].start, there[0].stop))
            begin += count
        if ours:
            mine, yours = np.concatenate(ours), np.concatenate(theirs)
            mean[yours] = self.mean[mine]
            covariance[np.ix_(yours, yours)] = self.covariance[np.ix_(mine, mine)]
        return mean, np.asarray(np.linalg.inv(covariance), dtype=np.float64)

    def write(self, file: h5py.File) -> None:
        """Write it to a model's file."""
        group = file.create_group("knowledge")
        group.attrs["stds"] = json.dumps(dict(self.stds))
        group.attrs["counts"] = json.dumps(dict(self.counts))
        group.create_dataset("mean", data=self.mean)
        group.create_dataset("covariance", data=self.covariance)

    @classmethod
    def read(cls, file: h5py.File) -> PadKnowledge | None:
        """That of a model's file, if it has any."""
        if "knowledge" not in file:
            return None
        stds, counts = (
            json.loads(str(file["knowledge"].attrs[name])) for name in ("stds", "counts")
        )
        mean, covariance = read(file, "knowledge/mean"), read(file, "knowledge/covariance")
        return cls(stds, counts, mean, covariance)
