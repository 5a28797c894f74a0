"""Electronic data sheets (CiA 306): read, checked."""
