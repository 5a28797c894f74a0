"""The same diagnosis and identification over all recordings of a fleet, on Dask distributed.

`sources` finds recordings, `tasks` is what a worker does with one of them, `run` hands them out, `dataset` keeps the
results, `pooling` says what is usual in the fleet and who is not, `page` shows it. Scheduling, retries and workers that
die are Dask's; it is imported by ``hil fleet`` alone (the extra ``fleet``).
"""
