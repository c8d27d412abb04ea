# Everything that weldcell links, all of it from Debian 12.
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(Ceres REQUIRED)
find_package(fmt REQUIRED)
find_package(spdlog REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(pugixml REQUIRED)
find_package(OpenSSL 3 REQUIRED)
find_package(Poco REQUIRED COMPONENTS Foundation Net NetSSL Crypto Util)
find_package(Protobuf REQUIRED)
find_package(PkgConfig REQUIRED)
pkg_check_modules(MODBUS REQUIRED IMPORTED_TARGET libmodbus)
pkg_check_modules(SODIUM REQUIRED IMPORTED_TARGET libsodium)
pkg_check_modules(SYSTEMD REQUIRED IMPORTED_TARGET libsystemd)
pkg_check_modules(CAIRO REQUIRED IMPORTED_TARGET cairo pangocairo)
pkg_check_modules(SDL2 REQUIRED IMPORTED_TARGET sdl2)

# What adapters and simulator may touch the world with; the core never links it.
add_library(weldcell_devices INTERFACE)
target_link_libraries(weldcell_devices INTERFACE
  Poco::NetSSL Poco::Crypto Poco::Net Poco::Foundation OpenSSL::SSL OpenSSL::Crypto pugixml::pugixml PkgConfig::MODBUS PkgConfig::SODIUM PkgConfig::SYSTEMD
  PkgConfig::CAIRO PkgConfig::SDL2 Threads::Threads)

# The EGM messages, generated as protobuf-lite into the build tree.
set(EGM_PROTO ${CMAKE_SOURCE_DIR}/src/wire/egm.proto)
set(EGM_OUT ${CMAKE_BINARY_DIR}/generated)
file(MAKE_DIRECTORY ${EGM_OUT})
add_custom_command(
  OUTPUT ${EGM_OUT}/egm.pb.cc ${EGM_OUT}/egm.pb.h
  COMMAND protobuf::protoc --cpp_out=lite:${EGM_OUT} --proto_path=${CMAKE_SOURCE_DIR}/src/wire ${EGM_PROTO}
  DEPENDS ${EGM_PROTO} VERBATIM)
add_library(weldcell_egm_proto STATIC ${EGM_OUT}/egm.pb.cc)
target_include_directories(weldcell_egm_proto SYSTEM PUBLIC ${EGM_OUT})
target_link_libraries(weldcell_egm_proto PUBLIC protobuf::libprotobuf-lite)
