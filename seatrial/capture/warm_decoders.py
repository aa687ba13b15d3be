"""What decoders need is loaded before anything comes."""

from __future__ import annotations

from seatrial.capture.decoders import decoder_for
from seatrial.capture.settings import PortSettings

#: A record of each protocol.
EXAMPLES = {
    "nmea": b"$HEHDT,10.0,T*1E\r\n$GPGGA,100000.00,5130.0000,N,00012.0000,E,4,12,0.8,5.0,M,45.0,M,,*63\r\n",
    "mavlink": bytes.fromhex("fd0900000001010000000000000000020303510304cf2b"),
    "slcan": b"T09F112248FF102700000000FC\r",
    "imu": b"#YPR=12.5,-1.0,0.25\r\n" * 3,
}


def warm_up(ports: tuple[PortSettings, ...]) -> None:
    """Load what the ports' decoders need before anything comes: the first record must not wait for it."""
    wanted = {p.protocol.value for p in ports}
    protocols = EXAMPLES if "auto" in wanted else wanted & EXAMPLES.keys()
    for protocol in protocols:
        decoder = decoder_for(protocol)
        if decoder is not None:
            decoder.feed([(0, EXAMPLES[protocol])])
