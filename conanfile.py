"""CONSAC's libraries for Conan 2: `conan create .`; then `find_package(consac)` has consac::core, consac::learn, consac::worlds and consac::c."""
import pathlib
import re

from conan import ConanFile
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy

HEADER = "core/include/consac/base/version.h"


class Consac(ConanFile):
    name = "consac"
    license = "MIT"
    description = "Reinforcement learning for game engines: models that act, learning in the engine's ticks, a C interface"
    topics = ("reinforcement-learning", "game-engine", "machine-learning")
    package_type = "static-library"
    settings = "os", "arch", "compiler", "build_type"
    exports = HEADER
    exports_sources = "CMakeLists.txt", "LICENSE", "cmake/*", "core/*", "learn/*", "worlds/*", "engines/host/*", "engines/c/*", "!*/test/*"

    def set_version(self):
        text = pathlib.Path(self.recipe_folder, HEADER).read_text(encoding="utf-8")
        self.version = re.search(r'kVersion = "([^"]+)"', text)[1]

    def requirements(self):
        self.requires("highway/[>=1.0.3 <2]", transitive_headers=False)
        for header_only in ("asio/[>=1.22 <2]", "eigen/[>=3.4 <4]", "fast_float/[>=3]", "nlohmann_json/[>=3.11 <4]"):
            self.requires(header_only, visible=False)

    def layout(self):
        cmake_layout(self)

    def generate(self):
        toolchain = CMakeToolchain(self)
        for part in ("PROGRAM", "TESTS", "BENCH", "GODOT"):
            toolchain.cache_variables[f"CONSAC_BUILD_{part}"] = False
        for header_only in ("asio", "fast_float"):  # which the build looks for where the compiler does
            toolchain.extra_cxxflags += [f"-isystem{path}" for path in self.dependencies[header_only].cpp_info.aggregated_components().includedirs]
        toolchain.generate()
        found = CMakeDeps(self)
        found.set_property("highway", "cmake_file_name", "hwy")
        found.set_property("highway::hwy", "cmake_target_name", "hwy::hwy")
        found.generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        CMake(self).install()
        copy(self, "LICENSE", self.source_folder, str(pathlib.Path(self.package_folder, "licenses")))

    def package_info(self):
        def part(name, library, needs=(), outside=()):
            component = self.cpp_info.components[name]
            component.set_property("cmake_target_name", f"consac::{name}")
            component.libs, component.requires = [library], [*needs, *outside]
            return component

        core = part("core", "consac_core", outside=["highway::hwy"])
        core.system_libs = {"Linux": ["pthread", "m"], "FreeBSD": ["pthread", "m"], "Windows": ["ws2_32", "mswsock"]}.get(str(self.settings.os), [])
        part("learn", "consac_learn", ["core"])
        part("worlds", "consac_worlds", ["core"])
        part("c", "consac")
