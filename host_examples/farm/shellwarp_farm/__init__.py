"""Bakes and sweeps of many shells on Dask: see docs/guide/farm.md.

scenes -> content -> cache -> job -> bake: a list of assets, shots, seeds and parameters becomes independent jobs; each distinct
shell is precomputed once into a shared cache; a job writes point caches and a record with their checksums. engine hands tasks
to Dask's workers, sweep and costs use it for studies.
"""
