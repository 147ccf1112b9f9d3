"""Small plot tables for the tests."""

HEADER = "scan,time_s,range_m,azimuth_deg,sigma_range_m,sigma_azimuth_deg"
GOOD = ["0,0.0,1000,10,5,0.1", "1,1.0,1010,350,5,0.1", "2,2.0,1020,-20,5,0.1"]


def write(path, *rows, header=HEADER):
    """A CSV file of rows."""
    path.write_text("\n".join([header, *rows]) + "\n")
    return path
