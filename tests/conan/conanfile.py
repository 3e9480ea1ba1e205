"""What CONSAC stands on as this machine has it installed, under the names that Conan's recipes have: for `conan create` without a network.
    for name in highway/1.0.3 asio/1.22.1 eigen/3.4.0 fast_float/3.5.1 nlohmann_json/3.11.2; do conan export tests/conan --name ${name%/*} --version ${name#*/}; done
    conan create . --no-remote --build=missing
"""
from conan import ConanFile

FOUND_AS = {"eigen": ("Eigen3", "Eigen3::Eigen"), "nlohmann_json": ("nlohmann_json", "nlohmann_json::nlohmann_json")}


class Installed(ConanFile):
    settings = "os", "arch"

    def package_info(self):
        self.cpp_info.bindirs = self.cpp_info.libdirs = []
        self.cpp_info.includedirs = ["/usr/include/eigen3"] if self.name == "eigen" else []
        if self.name == "highway":
            self.cpp_info.components["hwy"].system_libs = ["hwy"]
            self.cpp_info.components["hwy"].includedirs = []
        if self.name in FOUND_AS:
            file, target = FOUND_AS[self.name]
            self.cpp_info.set_property("cmake_file_name", file)
            self.cpp_info.set_property("cmake_target_name", target)
