"""What can be concealed: one file per effect, each with its draw of sizes. ``registry`` lists them."""
