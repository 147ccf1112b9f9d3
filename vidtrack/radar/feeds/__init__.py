"""What radars and ships send: ASTERIX, NMEA 0183 and AIS, from files and from the network, become plots."""
