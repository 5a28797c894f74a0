"""What a drive is asked for, which of its objects can give it, and what is done where none can.

What lives here: the table of functions and the plan made for one drive. What may come in: data sheets
(`drivers.datasheet`) and PDO layouts (`drivers.canopen`); no bus is opened.
"""
