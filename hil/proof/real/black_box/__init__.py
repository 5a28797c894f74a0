"""Black boxes on the same split: what one gets without any physics, judged by the same measure.

Both are given what the physical model is given: the free choice of the initial state and of one constant in every
stretch of every recording, held-out ones included. Nothing measured is fed back.
"""
