"""Put the machine code of all kernels into wheels, which then need no compiler where they are installed.

    python .ci/wheel.py WHEEL ... [--processors x86-64 x86-64-v3]

It needs contin as it is in the wheels, numba, the package wheel, and a C compiler (CC, or cc), which links. Each wheel is
replaced by one for this system. There is a library for each processor (by default for this machine's); the one that fits is
chosen where it is loaded.
"""

import argparse
import importlib
import os
import pkgutil
import platform
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from email.parser import Parser
from pathlib import Path

import contin
from contin.kernels import kernel, machine_code

#: What only the compiler needs.
COMPILER = {"numba"}


def link(path: Path) -> None:
    """Make the machine code of all kernels of contin, and link it to a shared library."""
    for module in pkgutil.walk_packages(contin.__path__, "contin."):
        importlib.import_module(module.name)
    kernels = [each for each in kernel.KERNELS if each.name.startswith("contin.")]
    objects = [path.with_name(f"{each.entry}.o") for each in kernels]
    for each, file in zip(kernels, objects):
        file.write_bytes(each.code.object)
    linker = os.environ.get("CC", "cc").split()
    subprocess.run([*linker, "-shared", "-o", str(path), *map(str, sorted(objects)), *_options(kernels)], check=True)


def _options(kernels: list) -> list[str]:
    """Return what the linker wants on this system; those of macOS and Windows are not tried."""
    if sys.platform == "darwin":
        return ["-undefined", "dynamic_lookup"]
    if sys.platform == "win32":
        names = [each.entry + ending for each in kernels for ending in ("", machine_code.INNER)]
        return [str(Path(sys.base_prefix, "libs", "python3.lib")), *(f"-Wl,/EXPORT:{name}" for name in names)]
    return ["-s", "-lm"]


def libraries(folder: Path, processors: list[str]) -> list[Path]:
    """Make the libraries of some processors, each in a process and with a cache of its own."""
    made = []
    for processor in processors or [machine_code.machine()[1]]:
        made.append(folder / processor / f"{machine_code.LIBRARY}{processor}.so")
        made[-1].parent.mkdir()
        cache = str(folder / processor / "cache")
        environment = {**os.environ, "CONTIN_PROCESSOR": processor, "CONTIN_CACHE_DIR": cache}
        subprocess.run([sys.executable, __file__, "--link", str(made[-1])], env=environment, check=True)
        print(f"{made[-1].name}: {made[-1].stat().st_size // 1024} kB")
    return made


def system() -> str:
    """Return the platform tag of wheels that run here: on Linux with this C library or a later one."""
    library, version = platform.libc_ver()
    here = re.sub(r"[-.]", "_", sysconfig.get_platform())
    return f"manylinux_{version.replace('.', '_')}_{platform.machine()}" if library == "glibc" else here


def filled(wheel: Path, made: list[Path]) -> None:
    """Replace a wheel by one that holds libraries, and does not ask for the compiler."""

    def run(*arguments: str) -> None:
        subprocess.run([sys.executable, "-m", "wheel", *arguments], check=True, stdout=subprocess.DEVNULL)

    with tempfile.TemporaryDirectory() as folder:
        run("unpack", "--dest", folder, str(wheel))
        (content,) = Path(folder).iterdir()
        for library in made:
            shutil.copy(library, content / "contin" / "kernels")
        (about,) = content.glob("*.dist-info")
        metadata = (about / "METADATA").read_text(encoding="utf-8")
        for needed in Parser().parsestr(metadata).get_all("Requires-Dist", []):
            if re.match(r"[\w-]+", needed)[0] in COMPILER and "extra ==" not in needed:
                metadata = metadata.replace(f"Requires-Dist: {needed}\n", "")
        (about / "METADATA").write_text(metadata, encoding="utf-8")
        tags = (about / "WHEEL").read_text(encoding="utf-8")
        tags = tags.replace("Root-Is-Purelib: true", "Root-Is-Purelib: false").replace("py3-none-any", f"py3-none-{system()}")
        (about / "WHEEL").write_text(tags, encoding="utf-8")
        wheel.unlink()
        run("pack", "--dest-dir", str(wheel.parent), str(content))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0], allow_abbrev=False)
    parser.add_argument("wheels", nargs="*", type=Path, metavar="WHEEL")
    parser.add_argument("--processors", nargs="+", default=[], metavar="NAME")
    parser.add_argument("--link", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.link:
        link(options.link)
    with tempfile.TemporaryDirectory() as folder:
        made = libraries(Path(folder), options.processors) if options.wheels else []
        for wheel in options.wheels:
            filled(wheel, made)
