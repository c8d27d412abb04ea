// Ports and network cards of host_facts.hpp.
#include <arpa/inet.h>
#include <ifaddrs.h>
#include <linux/ethtool.h>
#include <linux/sockios.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "weldcell/adapters/fd.hpp"
#include "weldcell/adapters/host_facts.hpp"

namespace weldcell::adapters {
namespace {

namespace fs = std::filesystem;

/// Inode of the socket that has the port, 0 when nobody has it. proc(5): local address as the hexadecimal of
/// the 32 bits in host order, state 0A is a listening TCP socket.
unsigned long socket_inode(const fs::path& table, bool udp, in_addr_t host, int port) {
  std::ifstream in(table);
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::istringstream words(line);
    std::string slot, local, remote, state, skip;
    unsigned long inode = 0;
    words >> slot >> local >> remote >> state;
    for (int i = 0; i < 5; ++i) words >> skip;
    words >> inode;
    const auto colon = local.find(':');
    if (!words || colon == std::string::npos || (!udp && state != "0A")) continue;
    const auto address = static_cast<in_addr_t>(std::strtoul(local.c_str(), nullptr, 16));
    if (std::strtol(local.c_str() + colon + 1, nullptr, 16) != port) continue;
    if (address == host || address == INADDR_ANY || host == INADDR_ANY) return inode;
  }
  return 0;
}

/// Fills in who holds the socket, as far as this user may see.
void find_holder(const HostPlaces& places, unsigned long inode, PortFacts& out) {
  const std::string wanted = "socket:[" + std::to_string(inode) + "]";
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(places.proc, error)) {
    const std::string pid = entry.path().filename();
    if (pid.find_first_not_of("0123456789") != std::string::npos) continue;
    std::error_code denied;
    for (const auto& fd : fs::directory_iterator(entry.path() / "fd", denied)) {
      std::error_code gone;
      if (fs::read_symlink(fd.path(), gone) != wanted) continue;
      out.pid = std::atoi(pid.c_str());
      std::ifstream in(entry.path() / "comm");
      std::getline(in, out.program);
      return;
    }
  }
}

/// One ethtool question; false where the driver does not answer it.
bool ethtool(int socket, const std::string& card, void* question) {
  ifreq request{};
  card.copy(request.ifr_name, IFNAMSIZ - 1);
  request.ifr_data = static_cast<char*>(question);
  return ::ioctl(socket, SIOCETHTOOL, &request) == 0;
}

void ask_card(CardFacts& card) {
  const Fd fd(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  ethtool_value link{};
  link.cmd = ETHTOOL_GLINK;
  card.link = ethtool(fd.get(), card.name, &link) && link.data != 0;
  ethtool_cmd settings{};
  settings.cmd = ETHTOOL_GSET;
  if (ethtool(fd.get(), card.name, &settings)) {
    const auto speed = ethtool_cmd_speed(&settings);
    if (speed != 0 && speed != static_cast<std::uint32_t>(SPEED_UNKNOWN))
      card.speed_mb_s = static_cast<int>(speed);
    if (settings.duplex != DUPLEX_UNKNOWN) card.full_duplex = settings.duplex == DUPLEX_FULL;
  }
  ethtool_coalesce coalesce{};
  coalesce.cmd = ETHTOOL_GCOALESCE;
  if (ethtool(fd.get(), card.name, &coalesce)) {
    card.rx_delay_us = coalesce.rx_coalesce_usecs;
    card.rx_adaptive = coalesce.use_adaptive_rx_coalesce != 0;
  }
}

CardFacts card_with(in_addr_t own) {
  CardFacts out;
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return out;
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    if (entry->ifa_addr == nullptr || entry->ifa_addr->sa_family != AF_INET) continue;
    const bool loopback = (entry->ifa_flags & IFF_LOOPBACK) != 0;
    const in_addr_t address = reinterpret_cast<const sockaddr_in*>(entry->ifa_addr)->sin_addr.s_addr;
    // Every address of 127/8 belongs to the loopback card.
    if (address != own && !(loopback && (ntohl(own) >> 24) == 127)) continue;
    out.name = entry->ifa_name;
    out.loopback = loopback;
    break;
  }
  ::freeifaddrs(list);
  if (!out.name.empty()) ask_card(out);
  return out;
}

}  // namespace

PortFacts port_facts(bool udp, const std::string& host, int port, const HostPlaces& places) {
  PortFacts out;
  in_addr address{};
  if (::inet_pton(AF_INET, host.c_str(), &address) != 1) return out;
  const unsigned long inode =
      socket_inode(fs::path(places.proc) / "net" / (udp ? "udp" : "tcp"), udp, address.s_addr, port);
  out.taken = inode != 0;
  if (out.taken) find_holder(places, inode, out);
  return out;
}

CardFacts card_of(const std::string& host) {
  in_addr address{};
  return ::inet_pton(AF_INET, host.c_str(), &address) == 1 ? card_with(address.s_addr) : CardFacts{};
}

CardFacts card_towards(const std::string& peer) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(9);
  if (::inet_pton(AF_INET, peer.c_str(), &to.sin_addr) != 1) return {};
  const Fd fd(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  // Connecting a UDP socket chooses the route and sends nothing.
  if (::connect(fd.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) return {};
  sockaddr_in own{};
  socklen_t size = sizeof own;
  if (::getsockname(fd.get(), reinterpret_cast<sockaddr*>(&own), &size) != 0) return {};
  return card_with(own.sin_addr.s_addr);
}

}  // namespace weldcell::adapters
