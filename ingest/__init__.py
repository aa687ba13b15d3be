"""A stage of Seatrial."""
