"""The workbench in the browser: a page, the server that answers it, and the processes that compute.

page/        what the browser loads: plain ES modules, no build step
server       addresses, who may ask, what is refused
connection   one open page: its requests, the newest first, and how many answers it has drawn
worker       a process that computes, and can be ended at any time
request      what a page may ask, checked
answers      from a request to numbers
frames       numbers as one binary message
"""
