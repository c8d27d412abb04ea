// weldcell plc-check: docs/PLC.md put to a server, or to a PLC that connects to us.
#include <charconv>
#include <csignal>
#include <cstdio>

#include "app/command_line.hpp"
#include "app/plc_check.hpp"
#include "app/plc_exam.hpp"
#include "weldcell/adapters/host_clock.hpp"
#include "weldcell/adapters/modbus_server.hpp"

namespace weldcell::app {

namespace {

constexpr const char* kUsage =
    "usage: weldcell plc-check HOST[:PORT] [--read-only] [--json]\n"
    "       weldcell plc-check --listen [HOST:]PORT [--allow ADDRESS]... [--word-order abcd|cdab]\n"
    "                          [--patience SECONDS] [--json]\n"
    "Each rule of docs/PLC.md by name: pass, or what was seen and how to mend it.\n"
    "  HOST[:PORT]    a cell's Modbus server (port 502). No command that moves anything is sent; still, take "
    "the\n"
    "                 PLC off first: two clients that write heartbeats get in each other's way\n"
    "  --read-only    writes nothing: also while a job is under way\n"
    "  --listen       plays a cell that runs one job, with a refusal, a lost heartbeat and a fault, and "
    "judges the\n"
    "                 PLC that connects\n"
    "exit codes: 0 every rule passed, 1 one failed, 2 bad usage, 3 no server there or the port is taken\n";

struct Address {
  std::string host;
  int port = 0;
};

std::optional<Address> address_of(const std::string& text, const std::string& host, int port) {
  Address out{host, port};
  const std::size_t colon = text.rfind(':');
  const bool number_only = text.find_first_not_of("0123456789") == std::string::npos;
  std::string digits;
  if (colon != std::string::npos) {
    out.host = text.substr(0, colon);
    digits = text.substr(colon + 1);
  } else if (number_only && port == 0) {
    digits = text;
  } else {
    out.host = text;
  }
  if (!digits.empty() || colon != std::string::npos) {
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), out.port);
    if (error != std::errc{} || end != digits.data() + digits.size() || out.port < 0 || out.port > 65535)
      return std::nullopt;
  }
  if (out.host.empty()) return std::nullopt;
  return out;
}

volatile std::sig_atomic_t g_ended = 0;

bool reserved_zero(const adapters::PlcWords& words) {
  return words[3] == 0 && words[6] == 0 && words[7] == 0 && words[8] == 0 && words[9] == 0;
}

int examine_plc(const Address& address, const std::vector<std::string>& allowed, wire::WordOrder order,
                double patience_s, bool json) {
  adapters::ModbusOptions options;
  options.host = address.host;
  options.port = address.port;
  options.allowed_clients = allowed;
  auto server = adapters::ModbusServer::listen(options);
  if (!server.ok()) {
    std::fprintf(stderr, "%s\n", server.error().text().c_str());
    return 3;
  }
  std::signal(SIGINT, [](int) { g_ended = 1; });
  std::signal(SIGTERM, [](int) { g_ended = 1; });
  std::fprintf(stderr, "listening on %s:%d\n", address.host.c_str(), server->port());
  PlcExamOptions exam_options;
  exam_options.patience_s = patience_s;
  PlcExam exam(exam_options);
  std::string told;
  while (!exam.over() && g_ended == 0) {
    server->set_status(wire::encode_plc_status(exam.step(adapters::now()), order));
    server->poll(20 * kMillisecond);
    while (const auto words = server->take_order())
      exam.write(wire::decode_plc_order(*words, order), reserved_zero(*words), adapters::now());
    if (const std::string wanted = exam.waiting_for(); wanted != told)
      std::fprintf(stderr, "waiting for %s\n", (told = wanted).c_str());
  }
  const PlcFindings findings = exam.findings();
  std::fputs((json ? findings_json("plc", findings) : findings_text(findings)).c_str(), stdout);
  return all_passed(findings) ? 0 : 1;
}

}  // namespace

int command_plc_check(Arguments arguments) {
  CommandLine line(arguments, kUsage, {"listen", "allow", "word-order", "patience"}, {"read-only", "json"});
  if (line.exit_code()) return *line.exit_code();
  const bool json = line.has("json");
  if (line.has("listen")) {
    const auto address = address_of(line.value("listen"), "127.0.0.1", 0);
    const std::string word_order = line.value("word-order", "abcd");
    const auto patience_s = line.number("patience", 120);
    if (!patience_s) return *line.exit_code();
    if (!line.plain().empty()) return line.refuse("--listen takes no HOST");
    if (!address) return line.refuse("--listen " + line.value("listen") + ": [HOST:]PORT is needed");
    if (word_order != "abcd" && word_order != "cdab") return line.refuse("--word-order is abcd or cdab");
    return examine_plc(*address, line.all("allow"),
                       word_order == "abcd" ? wire::WordOrder::Abcd : wire::WordOrder::Cdab, *patience_s,
                       json);
  }
  if (line.plain().size() != 1) return line.refuse("plc-check wants one HOST[:PORT], or --listen");
  const auto address = address_of(line.plain()[0], "", 502);
  if (!address) return line.refuse("'" + line.plain()[0] + "' is no HOST[:PORT]");
  PlcCheckOptions options;
  options.host = address->host;
  options.port = address->port;
  options.read_only = line.has("read-only");
  const PlcFindings findings = check_plc_server(options);
  std::fputs((json ? findings_json(line.plain()[0], findings) : findings_text(findings)).c_str(), stdout);
  return all_passed(findings) ? 0 : findings.size() == 1 ? 3 : 1;
}

}  // namespace weldcell::app
