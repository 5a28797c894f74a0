"""The line of a fit: the linear one, the filter that whitens its errors, and the input that would explain them."""
