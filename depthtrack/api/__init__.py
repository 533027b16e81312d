"""The functions of the public interface, one module a job.

`import depthtrack` offers all of them and loads each at its first use.
"""
