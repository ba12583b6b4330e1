"""Measure armangle.torch and armangle.jax beside the batch inverse of NumPy, in one process, interleaved.

    python benchmarks/bridges.py [--count 4096] [--rounds 60]

One thread each; the least wall time of all rounds, since XLA computes on threads of its own. In a round each
row runs three times in a row, so that it finds its own numbers in the cache and not those of another row.
"value" is one inverse of the batch, "and gradient" the gradient of a sum of its joints by the poses and arm
angles as well. The last column is the ratio to NumPy's inverse of the same batch.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import jax
import numpy as np
import torch
from yardstick import Yardstick

import armangle as aa

IN_A_ROW = 3


def rows(count: int) -> dict[str, Callable[[], object]]:
    """Return what is measured by name, the inverse of NumPy first."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    q = np.random.default_rng(17).uniform(arm.lower, arm.upper, (count, 7))
    pose, psi, gc = arm.forward(q)
    in_torch, in_jax = aa.torch.Kinematics(arm), aa.jax.Kinematics(arm)
    tensors = [torch.from_numpy(value) for value in (pose, psi, gc)]
    leaves = [tensor.clone().requires_grad_() for tensor in tensors[:2]]
    arrays = [jax.numpy.asarray(value) for value in (pose, psi, gc.astype(np.int32))]
    value = jax.jit(in_jax.inverse)
    both = jax.jit(jax.value_and_grad(lambda p, a, g: in_jax.inverse(p, a, g).sum(), argnums=(0, 1)))

    def backward() -> object:
        return torch.autograd.grad(in_torch.inverse(*leaves, tensors[2]).sum(), leaves)

    return {
        "NumPy inverse": lambda: arm.inverse(pose, psi, gc, limits=False),
        "NumPy gradients.inverse": lambda: aa.gradients.inverse(arm, pose, psi, gc),
        "torch, value": lambda: in_torch.inverse(*tensors),
        "torch, value and gradient": backward,
        "jax, value": lambda: jax.block_until_ready(value(*arrays)),
        "jax, value and gradient": lambda: jax.block_until_ready(both(*arrays)),
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=4096, help="poses of a batch")
    parser.add_argument("--rounds", type=int, default=60, help="the rows take turns so often")
    options = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    torch.set_num_threads(1)
    measured = rows(options.count)
    least = dict.fromkeys(measured, np.inf)
    angles = np.random.default_rng(17).uniform(-3, 3, (options.count, 8))
    yard, length = Yardstick(angles[:, :7], angles[:, 7]), np.inf
    for _ in range(options.rounds):
        length = min(length, yard.ns())
        for name, work in measured.items():
            for _ in range(IN_A_ROW):
                start = time.perf_counter()
                work()
                least[name] = min(least[name], time.perf_counter() - start)
    for name, seconds in least.items():
        ratio = seconds / least["NumPy inverse"]
        each = 1e9 * seconds / options.count
        print(f"{name:26} {each:8.1f} ns a pose {ratio:8.2f} {each / length:8.2f} yd")
    print(f"{aa.ISA}, 1 yd = {length:.1f} ns")


if __name__ == "__main__":
    main()
