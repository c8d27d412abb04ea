// The Modbus server against libmodbus' client, mbpoll and raw frames that no client would send.
#include "weldcell/adapters/modbus_server.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <modbus.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <random>
#include <string>
#include <thread>

#include "weldcell/adapters/fd.hpp"
#include "weldcell/adapters/host_clock.hpp"

namespace weldcell::adapters {
namespace {

using Frame = std::vector<std::uint8_t>;

/// The daemon's plc thread: polls until destroyed and keeps the orders.
class RunningServer {
 public:
  explicit RunningServer(ModbusOptions options = {}) : server_(make(std::move(options))) {
    PlcStatusWords status{};
    for (std::size_t i = 0; i < status.size(); ++i) status[i] = static_cast<std::uint16_t>(1000 + i);
    server_.set_status(status);
    thread_ = std::thread([this] {
      while (!stop_) {
        server_.poll(20 * kMillisecond);
        while (auto order = server_.take_order()) orders_.push_back(*order);
      }
    });
  }
  ~RunningServer() { stop(); }
  int port() const { return server_.port(); }
  ModbusServer& stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
    return server_;
  }
  const std::vector<PlcWords>& orders() const { return orders_; }

 private:
  static ModbusServer make(ModbusOptions options) {
    options.port = 0;
    auto server = ModbusServer::listen(options);
    EXPECT_TRUE(server.ok()) << server.error().text();
    return std::move(server).value();
  }
  ModbusServer server_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
  std::vector<PlcWords> orders_;
};

class Raw {
 public:
  explicit Raw(int port) : fd_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(fd_.get(), reinterpret_cast<sockaddr*>(&to), sizeof to), 0);
    timeval limit{5, 0};
    ::setsockopt(fd_.get(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  }
  bool send(const Frame& frame) const {
    return ::send(fd_.get(), frame.data(), frame.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(frame.size());
  }
  /// What came, empty when the server closed.
  Frame receive() const {
    Frame out(300);
    const ssize_t n = ::recv(fd_.get(), out.data(), out.size(), 0);
    EXPECT_TRUE(n >= 0 || errno == ECONNRESET) << "no answer within 5 s";
    out.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
    return out;
  }
  Frame ask(const Frame& frame) const {
    EXPECT_TRUE(send(frame));
    return receive();
  }

 private:
  Fd fd_;
};

Frame request(const Frame& pdu, std::uint8_t unit = 1) {
  Frame out(7 + pdu.size());
  out[0] = 0x12;
  out[1] = 0x34;
  out[4] = static_cast<std::uint8_t>((pdu.size() + 1) >> 8);
  out[5] = static_cast<std::uint8_t>(pdu.size() + 1);
  out[6] = unit;
  std::copy(pdu.begin(), pdu.end(), out.begin() + 7);
  return out;
}
Frame exception(std::uint8_t function, std::uint8_t code, std::uint8_t unit = 1) {
  return request({static_cast<std::uint8_t>(function | 0x80), code}, unit);
}

struct LibmodbusClient {
  explicit LibmodbusClient(int port) : context(modbus_new_tcp("127.0.0.1", port)) {
    EXPECT_EQ(modbus_connect(context), 0) << modbus_strerror(errno);
  }
  ~LibmodbusClient() {
    modbus_close(context);
    modbus_free(context);
  }
  modbus_t* context;
};

TEST(ModbusServer, PlcWritesItsBlockAndReadsTheStatus) {
  RunningServer server;
  {
    const LibmodbusClient plc(server.port());
    std::array<std::uint16_t, wire::kPlcReadWords> status{};
    ASSERT_EQ(modbus_read_registers(plc.context, 100, 40, status.data()), 40) << modbus_strerror(errno);
    EXPECT_EQ(status[0], 1000);
    EXPECT_EQ(status[39], 1039);
    const std::array<std::uint16_t, 10> order{1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
    ASSERT_EQ(modbus_write_registers(plc.context, 0, 10, order.data()), 10) << modbus_strerror(errno);
    ASSERT_EQ(modbus_write_register(plc.context, 9, 77), 1);
    std::array<std::uint16_t, 10> back{};
    ASSERT_EQ(modbus_read_registers(plc.context, 0, 10, back.data()), 10);
    EXPECT_EQ(back[0], 1);
    EXPECT_EQ(back[9], 77);
    std::array<std::uint16_t, 2> both{};
    const std::uint16_t heartbeat = 500;
    ASSERT_EQ(modbus_write_and_read_registers(plc.context, 0, 1, &heartbeat, 100, 2, both.data()), 2);
    EXPECT_EQ(both[1], 1001);
  }
  const ModbusServer& stopped = server.stop();
  ASSERT_EQ(server.orders().size(), 3u);
  EXPECT_EQ(server.orders()[0], (PlcWords{1, 2, 3, 4, 5, 6, 7, 8, 9, 10}));
  EXPECT_EQ(server.orders()[1][9], 77);
  EXPECT_EQ(server.orders()[2][0], 500);
  EXPECT_EQ(stopped.words()[0], 500);
}

TEST(ModbusServer, AnUnchangedImageIsNoNewOrder) {
  RunningServer server;
  {
    const LibmodbusClient plc(server.port());
    const std::array<std::uint16_t, 2> order{7, 8};
    for (int i = 0; i < 5; ++i) ASSERT_EQ(modbus_write_registers(plc.context, 0, 2, order.data()), 2);
  }
  server.stop();
  EXPECT_EQ(server.orders().size(), 1u);
}

TEST(ModbusServer, MbpollReadsAndWrites) {
  if (::access("/usr/bin/mbpoll", X_OK) != 0) GTEST_SKIP() << "mbpoll is not installed";
  RunningServer server;
  const std::string to = " -p " + std::to_string(server.port()) + " -m tcp -a 1 -0 -1 -t 4 ";
  EXPECT_EQ(std::system(("/usr/bin/mbpoll" + to + "-r 0 127.0.0.1 4711 -- 21 > /dev/null 2>&1").c_str()), 0);
  FILE* reader = ::popen(("/usr/bin/mbpoll" + to + "-r 100 -c 3 127.0.0.1 2>&1").c_str(), "r");
  ASSERT_NE(reader, nullptr);
  std::string text;
  for (std::array<char, 256> line{}; std::fgets(line.data(), line.size(), reader) != nullptr;)
    text += line.data();
  EXPECT_EQ(::pclose(reader), 0) << text;
  EXPECT_NE(text.find("[102]: \t1002"), std::string::npos) << text;
  server.stop();
  ASSERT_FALSE(server.orders().empty());
  EXPECT_EQ(server.orders()[0][0], 4711);
}

struct Refused {
  const char* what;
  Frame pdu;
  std::uint8_t code;
};

TEST(ModbusServer, RefusesByExceptionWhateverIsNotInTheMap) {
  RunningServer server;
  const Raw client(server.port());
  const Refused table[] = {
      {"read coils", {1, 0, 0, 0, 1}, 1},
      {"read input registers", {4, 0, 100, 0, 1}, 1},
      {"write coil", {5, 0, 0, 0xFF, 0}, 1},
      {"exception status, unanswered by the library", {7}, 1},
      {"report id, leaks the library's version", {0x11}, 1},
      {"mask write", {0x16, 0, 0, 0, 0, 0, 0}, 1},
      {"device identification", {0x2B, 0x0E, 1, 0}, 1},
      {"function 0", {0}, 1},
      {"read in the gap", {3, 0, 10, 0, 1}, 2},
      {"read across the end of the PLC's block", {3, 0, 9, 0, 2}, 2},
      {"read below the status block", {3, 0, 99, 0, 2}, 2},
      {"read beyond the status block", {3, 0, 139, 0, 2}, 2},
      {"read at the end of addresses", {3, 0xFF, 0xFF, 0, 125}, 2},
      {"read nothing", {3, 0, 100, 0, 0}, 3},
      {"read too many", {3, 0, 100, 0, 126}, 3},
      {"read cut short", {3, 0, 100, 0}, 3},
      {"read too long", {3, 0, 100, 0, 1, 0}, 3},
      {"write the status block", {6, 0, 100, 0, 1}, 2},
      {"write the gap", {6, 0, 10, 0, 1}, 2},
      {"write cut short", {6, 0, 1}, 3},
      {"write across the end", {16, 0, 9, 0, 2, 4, 0, 1, 0, 2}, 2},
      {"write with a wrong byte count", {16, 0, 0, 0, 2, 3, 0, 1, 0}, 3},
      {"write with fewer bytes than said", {16, 0, 0, 0, 2, 4, 0, 1, 0}, 3},
      {"write with more bytes than said", {16, 0, 0, 0, 1, 2, 0, 1, 0}, 3},
      {"write nothing", {16, 0, 0, 0, 0, 0}, 3},
      {"read and write into the status block", {23, 0, 100, 0, 1, 0, 100, 0, 1, 2, 0, 1}, 2},
      {"read outside and write inside", {23, 1, 0, 0, 1, 0, 0, 0, 1, 2, 0, 1}, 2},
      {"read and write cut short", {23, 0, 100, 0, 1, 0, 0, 0, 1}, 3},
  };
  for (const Refused& row : table)
    EXPECT_EQ(client.ask(request(row.pdu)), exception(row.pdu[0], row.code)) << row.what;
  EXPECT_EQ(client.ask(request({3, 0, 100, 0, 1})), request({3, 2, 0x03, 0xE8})) << "still serves";
  const ModbusServer& stopped = server.stop();
  EXPECT_EQ(stopped.counters().exceptions, std::size(table));
  EXPECT_TRUE(server.orders().empty());
  EXPECT_EQ(stopped.words(), PlcWords{});
}

TEST(ModbusServer, ForeignUnitGetsGatewayException) {
  RunningServer server;
  const Raw client(server.port());
  EXPECT_EQ(client.ask(request({3, 0, 100, 0, 1}, 99)), exception(3, 0x0B, 99));
  EXPECT_EQ(client.ask(request({3, 0, 100, 0, 1}, 255)), request({3, 2, 0x03, 0xE8}, 255));
}

TEST(ModbusServer, WhatIsNotModbusIsClosed) {
  RunningServer server;
  const Frame table[] = {
      {'G', 'E', 'T', ' ', '/', ' ', 'H', 'T'},
      {0, 1, 0, 1, 0, 6, 1, 3, 0, 100, 0, 1},  // protocol 1
      {0, 1, 0, 0, 0, 0},                      // length 0
      {0, 1, 0, 0, 0, 1, 1},                   // a unit and no function
      {0, 1, 0, 0, 0xFF, 0xFF, 1, 3},          // longer than a frame may be
      {0, 1, 0, 0, 0, 255, 1, 16},
      {0, 1, 0, 0, 0, 6, 1, 0x83, 0, 100, 0, 1},  // an answer, not a request
  };
  for (const Frame& bytes : table) {
    const Raw client(server.port());
    EXPECT_EQ(client.ask(bytes), Frame{}) << ::testing::PrintToString(bytes);
  }
  EXPECT_EQ(server.stop().counters().malformed, std::size(table));
}

TEST(ModbusServer, HalfAHeaderHoldsUpNobodyAndIsThenClosed) {
  ModbusOptions options;
  options.half_frame_timeout = 300 * kMillisecond;
  RunningServer server(options);
  const Raw half(server.port());
  ASSERT_TRUE(half.send({0, 1, 0}));
  const LibmodbusClient plc(server.port());
  std::uint16_t value = 0;
  Nanoseconds worst = 0;
  for (int i = 0; i < 50; ++i) {
    const HostTime before = now();
    ASSERT_EQ(modbus_read_registers(plc.context, 100, 1, &value), 1);
    worst = std::max(worst, now() - before);
  }
  RecordProperty("worst_read_us", static_cast<int>(worst / kMicrosecond));
  EXPECT_EQ(half.receive(), Frame{});
}

TEST(ModbusServer, FramesInPiecesAndInOnePacketAreAllAnswered) {
  RunningServer server;
  const Raw client(server.port());
  const Frame one = request({3, 0, 100, 0, 1});
  for (std::size_t i = 0; i + 1 < one.size(); ++i) {
    ASSERT_TRUE(client.send({one[i]}));
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  const Frame answer = request({3, 2, 0x03, 0xE8});
  EXPECT_EQ(client.ask({one.back()}), answer);
  Frame three;
  for (int i = 0; i < 3; ++i) three.insert(three.end(), one.begin(), one.end());
  Frame got = client.ask(three);
  while (got.size() < 3 * answer.size()) {
    const Frame more = client.receive();
    ASSERT_FALSE(more.empty());
    got.insert(got.end(), more.begin(), more.end());
  }
  Frame expected;
  for (int i = 0; i < 3; ++i) expected.insert(expected.end(), answer.begin(), answer.end());
  EXPECT_EQ(got, expected);
}

TEST(ModbusServer, ANinthClientIsClosedUnlessOneIsIdle) {
  ModbusOptions options;
  options.idle_before_eviction = 200 * kMillisecond;
  RunningServer server(options);
  std::vector<Raw> clients;
  for (int i = 0; i < 8; ++i) {
    clients.emplace_back(server.port());
    ASSERT_FALSE(clients.back().ask(request({3, 0, 100, 0, 1})).empty());
  }
  {
    const Raw ninth(server.port());
    EXPECT_EQ(ninth.receive(), Frame{});
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  for (int i = 1; i < 8; ++i) ASSERT_FALSE(clients[i].ask(request({3, 0, 100, 0, 1})).empty());
  const Raw tenth(server.port());
  EXPECT_FALSE(tenth.ask(request({3, 0, 100, 0, 1})).empty());
  EXPECT_EQ(clients[0].receive(), Frame{}) << "the idle one made room";
}

TEST(ModbusServer, OnlyAllowedAddressesAreServed) {
  ModbusOptions options;
  options.allowed_clients = {"192.0.2.7"};
  RunningServer server(options);
  const Raw client(server.port());
  EXPECT_EQ(client.receive(), Frame{});
  EXPECT_EQ(server.stop().counters().refused_clients, 1u);
}

TEST(ModbusServer, RandomFramesDoNoHarm) {
  constexpr unsigned kSeed = 20250117;
  std::mt19937 random(kSeed);
  RunningServer server;
  int answered = 0;
  for (int round = 0; round < 300; ++round) {
    Frame pdu(1 + random() % 40);
    for (auto& byte : pdu) byte = static_cast<std::uint8_t>(random());
    constexpr std::uint8_t kFunctions[] = {3, 6, 16, 23, 1, 7, 0x2B};
    pdu[0] &= 0x7F;
    if (round % 4 != 0) pdu[0] = kFunctions[random() % std::size(kFunctions)];
    const Raw client(server.port());
    const Frame reply = client.ask(request(pdu));
    ASSERT_GE(reply.size(), 9u) << "seed " << kSeed << " pdu " << ::testing::PrintToString(pdu);
    ASSERT_EQ(reply[7] & 0x7F, pdu[0]) << "seed " << kSeed << " pdu " << ::testing::PrintToString(pdu);
    ++answered;
  }
  EXPECT_EQ(answered, 300);
  const LibmodbusClient plc(server.port());
  std::uint16_t value = 0;
  EXPECT_EQ(modbus_read_registers(plc.context, 139, 1, &value), 1);
  EXPECT_EQ(value, 1039);
}

TEST(ModbusServer, SaysWhyItCannotListen) {
  ModbusOptions options;
  options.port = 0;
  auto first = ModbusServer::listen(options);
  ASSERT_TRUE(first.ok());
  options.port = first->port();
  EXPECT_EQ(ModbusServer::listen(options).error().code, "modbus.bind");
  options.host = "plc";
  EXPECT_EQ(ModbusServer::listen(options).error().code, "modbus.address");
}

}  // namespace
}  // namespace weldcell::adapters
