# Copyright Spack Project Developers. See COPYRIGHT file for details.
#
# SPDX-License-Identifier: (Apache-2.0 OR MIT)

from spack_repo.builtin.build_systems.cargo import CargoPackage

from spack.package import *


class Asperity(CargoPackage):
    """Statistical studies of rough contact: generates or reads rough surfaces, presses them with an
    FFT boundary-element solver, and averages the results over many surfaces."""

    homepage = "https://github.com/asperity/asperity"
    url = "https://github.com/asperity/asperity/archive/refs/tags/v0.2.0.tar.gz"
    git = "https://github.com/asperity/asperity.git"

    license("MIT OR Apache-2.0", checked_by="asperity")

    version("main", branch="main")
    # `spack checksum asperity 0.2.0` prints the checksum of the released archive.
    version("0.2.0", sha256="0" * 64)

    depends_on("c", type="build")
    depends_on("rust@1.95:", type="build")

    @property
    def build_args(self):
        return ["--locked", "--profile", "dist"]

    @run_after("install")
    @on_package_attributes(run_tests=True)
    def check_install(self):
        Executable(self.prefix.bin.asperity)("--version")
