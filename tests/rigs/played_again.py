# SPDX-License-Identifier: MIT
"""A run of the launcher's, played once more by QEMU alone."""
import resource

from launcher.paths import build_dir
from launcher.qemu import Image, Qemu, command, escape, run_to_end


def again(run, folder, *lines):
    """The same run from its own configuration with more lines in it; how often QEMU gave its processor away."""
    text = (run.out_dir / "twin.cfg").read_text().replace(str(run.out_dir), str(folder))
    config = folder / "twin.cfg"
    config.write_text("".join(line + "\n" for line in (text.rstrip("\n"), *lines)))
    qemu = Qemu()
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_nvcsw
    run_to_end(command(qemu, Image(build_dir()), config, f"file,id=console,path={escape(folder / 'console.txt')}"),
               qemu.environment(), float(run.trace["t_s"][-1]), folder / "progress", folder / "qemu.log")
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_nvcsw - before
