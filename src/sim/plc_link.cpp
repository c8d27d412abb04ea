#include "sim/plc_link.hpp"

#include <modbus/modbus.h>

#include <chrono>
#include <memory>

namespace weldcell::sim {

namespace {
constexpr auto kCycle = std::chrono::milliseconds(100);
constexpr auto kReconnect = std::chrono::milliseconds(300);
}  // namespace

PlcLink::PlcLink(files::Endpoint endpoint, wire::WordOrder word_order, PlcWorker worker)
    : endpoint_(std::move(endpoint)), word_order_(word_order), worker_(worker), thread_([this] { run(); }) {}

PlcLink::~PlcLink() {
  stop_ = true;
  thread_.join();
}

void PlcLink::run() {
  const auto start = std::chrono::steady_clock::now();
  while (!stop_) {
    const std::unique_ptr<modbus_t, void (*)(modbus_t*)> link(
        modbus_new_tcp(endpoint_.host.c_str(), endpoint_.port), [](modbus_t* m) {
          modbus_close(m);
          modbus_free(m);
        });
    if (link) modbus_set_response_timeout(link.get(), 1, 0);
    if (!link || modbus_connect(link.get()) != 0) {
      std::this_thread::sleep_for(kReconnect);
      continue;
    }
    while (!stop_) {
      std::array<std::uint16_t, wire::kPlcReadWords> in{};
      if (modbus_read_registers(link.get(), wire::kPlcReadBase, wire::kPlcReadWords, in.data()) !=
          wire::kPlcReadWords)
        break;
      const double now_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      const auto out =
          wire::encode_plc_order(worker_.step(wire::decode_plc_status(in, word_order_), now_s), word_order_);
      if (modbus_write_registers(link.get(), wire::kPlcWriteBase, wire::kPlcWriteWords, out.data()) !=
          wire::kPlcWriteWords)
        break;
      connected_ = true;
      std::this_thread::sleep_for(kCycle);
    }
    connected_ = false;
  }
}

}  // namespace weldcell::sim
