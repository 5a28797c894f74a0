"""The paper's figures in print quality, by matplotlib: SVG and PDF, the same bytes from the same data."""
