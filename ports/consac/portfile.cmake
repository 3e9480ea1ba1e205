# The libraries of the repository that this file is part of; as an overlay: vcpkg install consac --overlay-ports=CONSAC/ports
get_filename_component(SOURCE_PATH "${CURRENT_PORT_DIR}/../.." ABSOLUTE)

vcpkg_cmake_configure(
    SOURCE_PATH "${SOURCE_PATH}"
    OPTIONS
        -DCONSAC_BUILD_PROGRAM=OFF
        -DCONSAC_BUILD_TESTS=OFF
        -DCONSAC_BUILD_BENCH=OFF
        -DCONSAC_BUILD_GODOT=OFF
)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(PACKAGE_NAME consac CONFIG_PATH lib/cmake/consac)
vcpkg_fixup_pkgconfig()
vcpkg_copy_pdbs()
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
