"""A cell's Modbus server in a few lines, right in mode "none" and wrong in one way in every other mode. For plc-check's own test."""
import socket
import struct
import sys
import threading
import time

# mode -> the rule of `weldcell plc-check` that must name it
MODES = {
    "test_word_beside": "map.test_word",
    "real_bytes_swapped": "map.word_order",
    "reserved_used": "map.reserved_zero",
    "state_unknown": "values.in_range",
    "heartbeat_still": "heartbeat.counts_up",
    "never_echoes": "command.echoed",
    "level_acts": "command.counts_once",
    "unknown_taken": "command.unknown_refused",
    "status_writable": "refuse.write_outside",
    "tells_its_version": "refuse.other_functions",
    "silent_to_fc7": "refuse.other_functions",
    "any_unit": "unit.foreign_refused",
    "transaction_lost": "frame.header_echoed",
    "half_header_blocks": "frame.half_header_blocks_nobody",
    "one_request_a_packet": "frame.two_in_one_packet",
    "one_client": "clients.three_at_once",
}


class Server:
    def __init__(self, mode):
        self.mode = mode
        self.words = [0] * 140
        self.words[100:104] = [0x1234, 0, 0x42F6, 0xE979]
        self.words[106], self.words[107], self.words[127] = 4, 1, 2
        if mode == "test_word_beside":
            self.words[100], self.words[101] = 0, 0x1234
        if mode == "real_bytes_swapped":
            self.words[102:104] = [0xF642, 0x79E9]
        if mode == "reserved_used":
            self.words[133] = 7
        if mode == "state_unknown":
            self.words[106] = 42
        self.lock = threading.Lock()
        self.turn = threading.Lock()
        self.clients = 0
        self.listener = socket.create_server(("127.0.0.1", 0), backlog=16)
        self.port = self.listener.getsockname()[1]
        threading.Thread(target=self.accept, daemon=True).start()
        if mode != "heartbeat_still":
            threading.Thread(target=self.beat, daemon=True).start()

    def beat(self):
        at = 101 if self.mode != "test_word_beside" else 128
        while True:
            time.sleep(0.5)
            if at == 101:
                self.words[at] = (self.words[at] + 1) & 0xFFFF

    def accept(self):
        while True:
            client, _ = self.listener.accept()
            with self.lock:
                self.clients += 1
                full = self.mode == "one_client" and self.clients > 1
            if full:
                client.close()
                with self.lock:
                    self.clients -= 1
                continue
            threading.Thread(target=self.serve, args=(client,), daemon=True).start()

    def read(self, client, count):
        data = b""
        while len(data) < count:
            piece = client.recv(count - len(data))
            if not piece:
                raise ConnectionError
            data += piece
        return data

    def serve(self, client):
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        try:
            while True:
                if self.mode == "half_header_blocks":
                    client.recv(1, socket.MSG_PEEK)
                    with self.turn:
                        client.settimeout(0.4)
                        head = self.read(client, 7)
                        client.settimeout(None)
                else:
                    head = self.read(client, 7)
                transaction, protocol, size, unit = struct.unpack(">HHHB", head)
                if protocol != 0 or not 2 <= size <= 254:
                    return
                pdu = self.read(client, size - 1)
                if self.mode == "one_request_a_packet":
                    client.setblocking(False)
                    try:
                        client.recv(4096)
                    except BlockingIOError:
                        pass
                    client.setblocking(True)
                with self.lock:
                    answer = self.answer(unit, pdu)
                if answer is None:
                    continue
                if self.mode == "transaction_lost":
                    transaction = 0
                client.sendall(struct.pack(">HHHB", transaction, 0, len(answer) + 1, unit) + answer)
        except (OSError, ConnectionError):
            pass
        finally:
            client.close()
            with self.lock:
                self.clients -= 1

    def answer(self, unit, pdu):
        code = pdu[0]

        def refuse(number):
            return bytes([code | 0x80, number])

        def known(at, count):
            return at + count <= 10 or (100 <= at and at + count <= 140)

        if unit not in (0, 1, 255) and self.mode != "any_unit":
            return refuse(11)
        if code == 17 and self.mode == "tells_its_version":
            return bytes([17, 8]) + b"CELL 1.0"
        if code == 7 and self.mode == "silent_to_fc7":
            return None
        if code not in (3, 6, 16, 23):
            return refuse(1)
        if code == 3:
            at, count = struct.unpack(">HH", pdu[1:5])
            if not 1 <= count <= 125:
                return refuse(3)
            if not known(at, count):
                return refuse(2)
            return bytes([3, 2 * count]) + struct.pack(f">{count}H", *self.words[at:at + count])
        if code == 6:
            at, value = struct.unpack(">HH", pdu[1:5])
            return pdu if self.write(at, [value]) else refuse(2)
        if code == 16:
            at, count, size = struct.unpack(">HHB", pdu[1:6])
            if size != 2 * count or len(pdu) != 6 + size:
                return refuse(3)
            return pdu[:5] if self.write(at, struct.unpack(f">{count}H", pdu[6:])) else refuse(2)
        read_at, reads, at, count, _ = struct.unpack(">HHHHB", pdu[1:10])
        if not self.write(at, struct.unpack(f">{count}H", pdu[10:])) or not known(read_at, reads):
            return refuse(2)
        return bytes([23, 2 * reads]) + struct.pack(f">{reads}H", *self.words[read_at:read_at + reads])

    def write(self, at, values):
        own = at + len(values) <= 10
        if not own and not (self.mode == "status_writable" and 100 <= at and at + len(values) <= 140):
            return False
        before = self.words[1]
        self.words[at:at + len(values)] = values
        if own and (self.words[1] != before or self.mode == "level_acts"):
            self.command()
        return True

    def command(self):
        if self.mode != "never_echoes":
            self.words[104] = self.words[1]
        known = self.words[2] in (*range(0, 10), *range(20, 24))
        self.words[105] = 0 if known or self.mode == "unknown_taken" else 2


if __name__ == "__main__":
    server = Server(sys.argv[1] if len(sys.argv) > 1 else "none")
    print(server.port, flush=True)
    threading.Event().wait()
