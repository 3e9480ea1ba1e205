"""ports/consac for vcpkg and conanfile.py for Conan 2: what can be seen of them without either."""
import json
import pathlib
import re
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]
# vcpkg's own functions, as far as the port calls them: the first configures as vcpkg does, the others say that they were called.
STAND_INS = r"""
function(vcpkg_cmake_configure)
  cmake_parse_arguments(ARG "" "SOURCE_PATH" "OPTIONS" ${ARGN})
  execute_process(COMMAND ${CMAKE_COMMAND} -G Ninja -S ${ARG_SOURCE_PATH} -B ${CURRENT_PACKAGES_DIR}/build ${ARG_OPTIONS} -DCMAKE_BUILD_TYPE=Release
                          -DCMAKE_INSTALL_LIBDIR=lib COMMAND_ERROR_IS_FATAL ANY)
endfunction()
foreach(name vcpkg_cmake_install vcpkg_cmake_config_fixup vcpkg_fixup_pkgconfig vcpkg_copy_pdbs vcpkg_install_copyright)
  cmake_language(EVAL CODE "function(${name})\n message(STATUS \"called ${name} \${ARGN}\")\nendfunction()")
endforeach()
"""


def test_the_port_configures_the_libraries_and_nothing_else(tmp_path):
    (tmp_path / "port.cmake").write_text(STAND_INS + f'set(CURRENT_PORT_DIR "{ROOT}/ports/consac")\nset(CURRENT_PACKAGES_DIR "{tmp_path}/packages")\n'
                                                     f'include("{ROOT}/ports/consac/portfile.cmake")\n')
    done = subprocess.run(["cmake", "-P", tmp_path / "port.cmake"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "not used by the project" not in done.stderr, done.stderr
    assert "called vcpkg_cmake_config_fixup PACKAGE_NAME;consac;CONFIG_PATH;lib/cmake/consac" in done.stdout
    assert (ROOT / "LICENSE").is_file() and f"FILE_LIST;{ROOT}/LICENSE" in done.stdout.replace("ports/consac/../../", "")
    targets = subprocess.run(["ninja", "-C", tmp_path / "packages/build", "-t", "targets", "all"], capture_output=True, text=True, check=True).stdout
    made = set(re.findall(r"^(consac\w*): phony", targets, re.M))
    assert {"consac_core", "consac_learn", "consac_worlds", "consac_c"} <= made and not {"consac", "consac_run", "consac_godot"} & made, made


def test_both_name_what_the_build_looks_for():
    build = (ROOT / "CMakeLists.txt").read_text().split("add_subdirectory(core)")[0]
    wanted = set(re.findall(r"^find_package\((\w+) ?", build, re.M)) - {"Threads"}
    port, recipe = json.loads((ROOT / "ports/consac/vcpkg.json").read_text()), (ROOT / "conanfile.py").read_text()
    names = {"hwy": ("highway", "highway"), "Eigen3": ("eigen3", "eigen"), "nlohmann_json": ("nlohmann-json", "nlohmann_json")}
    for package in wanted:
        in_vcpkg, in_conan = names[package]
        assert in_vcpkg in port["dependencies"] and f'"{in_conan}/[' in recipe
